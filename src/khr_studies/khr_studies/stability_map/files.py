"""``khr map``: count the runs of a sweep, and write their map as a picture and tables."""

from __future__ import annotations

from pathlib import Path

from khr_common.files import write_text, written
from khr_report.folders import make_folder
from khr_report.page.text import csv_text
from khr_report.plots.plot_style import save, styled
from khr_studies.stability_map.figure import figure
from khr_studies.stability_map.study import stability_map
from khr_studies.stability_map.tables import tables
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
        KhrError: if there is no sweep, a parameter is not swept, or a file cannot be written.
    """
    counted = stability_map(read_results(folder), x, y)
    image = out or (folder if folder.is_dir() else folder.parent) / f'map_{x}_{y}.png'
    rows_by_file = {
        image.with_name(f'{image.stem}{end}.csv'): rows for end, rows in tables(counted).items()
    }
    make_folder(image.parent)
    with styled(), written(image) as part:
        save(figure(counted), part)
    for path, rows in rows_by_file.items():
        write_text(path, csv_text(rows[0], (row.values() for row in rows), 6))
    return [image, *rows_by_file]
