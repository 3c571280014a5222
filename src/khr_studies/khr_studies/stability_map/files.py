"""``khr map``: count the runs of a sweep, and write their map as a picture and tables."""

from __future__ import annotations

from pathlib import Path

from khr_report.plots.plot_style import save, styled
from khr_studies.errors import StudyError
from khr_studies.stability_map.figure import figure
from khr_studies.stability_map.study import stability_map
from khr_studies.stability_map.tables import tables, write_csv
from khr_sweeps.results.folder import read_results


def draw_map(folder: Path, x: str, y: str, out: Path | None = None) -> list[Path]:
    """Draw the map of a sweep; return the paths of the PNG and the CSVs.

    The CSV beside the PNG has a row per cell; a second one, ``..._critical``, a row per y; on a
    map of inclination and a gain a third one, ``..._best``, has the best gain per inclination.

    Args:
        folder: of the sweep, complete or not.
        x, y: swept parameters, ``node.parameter``.
        out: the PNG; ``map_X_Y.png`` in the folder by default.

    Raises:
        StudyError: if there is no sweep, or a parameter is not swept.
        StudyError: if a file cannot be written.
    """
    counted = stability_map(read_results(folder), x, y)
    image = out or (folder if folder.is_dir() else folder.parent) / f'map_{x}_{y}.png'
    rows_by_file = {
        image.with_name(f'{image.stem}{end}.csv'): rows for end, rows in tables(counted).items()
    }
    try:
        image.parent.mkdir(parents=True, exist_ok=True)
        with styled():
            save(figure(counted), image)
        for path, rows in rows_by_file.items():
            write_csv(path, rows)
    except OSError as error:
        raise StudyError(
            f'--out: {str(image)!r}: {error.strerror}; accepted: a file in a '
            'folder that can be written'
        ) from error
    return [image, *rows_by_file]
