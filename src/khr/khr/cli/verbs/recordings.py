"""Verbs for finished runs."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from khr.cli.verbs.options import (
    AxisOption,
    NamespaceOption,
    TopicOption,
    recording_named,
    run_named,
)
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.bout.bout import is_bout
from khr_bringup.run_folder import of_robot
from khr_common.errors import KhrError
from khr_common.files import written
from khr_sweeps.progress import ProgressBar


def film(
    run: Annotated[
        str,
        typer.Argument(
            help='Folder of a run or bout, a bag, "last", or a scenario or bout (file or name).'
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help='The file without suffix (with --still: the PNG); in the run folder if left out.'
        ),
    ] = None,
    still: Annotated[
        float | None, typer.Option(help='Only the picture at this time, in s.')
    ] = None,
    start: Annotated[float, typer.Option(help='Where the film starts, in s.')] = 0.0,
    end: Annotated[float | None, typer.Option(help='Where it ends, in s.')] = None,
    width: Annotated[int, typer.Option(help='Width of the pictures, in px.')] = 960,
    height: Annotated[int, typer.Option(help='Height of the pictures, in px.')] = 720,
    rate: Annotated[float, typer.Option(help='Pictures per simulated second.')] = 25.0,
    against: Annotated[
        str | None, typer.Option(help='Another run to show on the right, of the same size.')
    ] = None,
    namespace: NamespaceOption = '',
) -> None:
    """Render a run to MP4 and GIF, or one picture of it to PNG."""
    from khr_report.film.film import render_run

    size = (width, height, rate)
    chosen = _filmed(run)
    if is_bout(chosen):
        if against or namespace:
            raise KhrError(
                f'{"--against" if against else "--namespace"}: not accepted of a bout, which shows '
                'both robots'
            )
        from khr_report.film.bout import render_bout

        with ProgressBar(unit='s') as bar:
            files = render_bout(chosen, out, still, (start, end), size, bar.show)
        print('\n'.join(map(str, files)))
        return
    with ProgressBar(unit='s') as bar:
        files = render_run(
            chosen,
            out,
            still,
            (start, end),
            size,
            against and _filmed(against),
            bar.show,
            namespace,
        )
    for path in files:
        print(path)


def report(
    run: Annotated[
        Path,
        typer.Argument(help='Folder of a run or bout, any rosbag2, or "last" for the newest run.'),
    ],
    against: Annotated[Path | None, typer.Option(help='Another run to compare it with.')] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The page; by default report.html in the run's folder, report_NAME.html with "
            '--namespace NAME. Or .pdf, .svg, .png for the charts alone.'
        ),
    ] = None,
    topic: TopicOption = '',
    axis: AxisOption = '',
    namespace: NamespaceOption = '',
) -> None:
    """Write a page about a run, one that compares two, or one about any recording."""
    from khr_report.output import check_file
    from khr_report.plots.plot_style import PICTURES
    from khr_report.run.overview import draw_run
    from khr_report.run.page import report as write

    if out:
        check_file(out, '.html', *PICTURES)
    if out and out.suffix in PICTURES:
        if against:
            raise KhrError(
                f'--out: {str(out)!r} is not accepted with --against; accepted: a name in .html'
            )
        if topic or axis:
            raise KhrError(
                f'{"--topic" if topic else "--axis"}: not accepted with --out {str(out)!r}, the '
                'charts of a khr run; accepted: --out with a name in .html'
            )
        draw_run(recording_named(str(run)), out, namespace)
        print(out)
        return
    other = recording_named(str(against)) if against else None
    print(write(recording_named(str(run)), other, out, topic, axis, namespace))


def verify_bag(
    bag: Annotated[Path, typer.Argument(help='Folder of a run or bout, a bag, or "last".')],
    namespace: NamespaceOption = '',
) -> None:
    """Check a recording, repeat its run, compare all numbers; exit with 1 if any differs."""
    from khr_bringup.bout.recorded import bout_of_round, verify_bout
    from khr_bringup.recorded.verify import verify

    folder = run_named(str(bag))
    if whole := bout_of_round(folder):
        raise KhrError(f'{bag}: a round of a bout; accepted: the folder of its bout, {whole}')
    if folder.is_dir() and is_bout(str(folder)):
        with ProgressBar(unit='s') as bar:
            raise typer.Exit(verify_bout(folder, lambda time: bar.show('repeating', time)))
    raise typer.Exit(verify(folder, namespace))


def recover_bag(
    bag: Annotated[Path, typer.Argument(help='A bag, an MCAP file, or the folder of a run.')],
) -> None:
    """Repair a damaged bag, or that of a recorder that was killed; the damaged file is kept."""
    from khr_bringup.recorded.recover import recover

    found = recover(run_named(str(bag)))
    if found is None:
        print(f'{bag}: whole')
        return
    print(f'{found.bag}: {found.messages} messages up to t = {found.seconds:.3f} s')
    if found.damaged:
        print(f'damaged chunks that are left out: {found.damaged}')
    print(f'the bag as it was is kept as {found.kept}')


def export(
    run: Annotated[
        Path,
        typer.Argument(
            help='A run folder, or its bag; "last" is the newest run. With --motion also a scenario.'
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help='The file, .csv or .parquet (with --motion .csv or .yaml); by default RUN.csv in '
            'this folder, RUN_NAME.csv with --namespace NAME.'
        ),
    ] = None,
    motion: Annotated[
        bool, typer.Option('--motion', help='Write the key frames of the motion instead.')
    ] = False,
    namespace: NamespaceOption = '',
) -> None:
    """Write joints, pose, forces, corrections and balance of a run over time as CSV or Parquet."""
    if motion:
        _export_motion(str(run), out, namespace)
        return
    import pyarrow
    import pyarrow.csv
    import pyarrow.parquet

    from khr.runs import load

    folder = run_named(str(run))
    file = out or Path(f'{of_robot(folder.resolve().name, namespace)}.csv')
    writers = {'.csv': pyarrow.csv.write_csv, '.parquet': pyarrow.parquet.write_table}
    if file.suffix not in writers:
        raise KhrError.refused('--out', str(file), 'FILE.csv or FILE.parquet')
    loaded = load(recording_named(str(run)), namespace=namespace)
    table = loaded.table()
    if file.suffix == '.csv':  # one column for each signal, with its unit and angles in deg
        balance = {f'{name}, m': table[name] for name in table.column_names if 'balance' in name}
        table = pyarrow.table(loaded.signals.with_units | balance)
    with written(file) as part:
        writers[file.suffix](table, part)
    print(file)


def _export_motion(run: str, out: Path | None, namespace: str = '') -> None:
    """Write the key frames of a scenario or run, and print how a scenario names them."""
    from khr.runs import load
    from khr_bringup.recorded.storage import is_recording
    from khr_bringup.scenario.motion_file import write_motion
    from khr_bringup.scenario.scenario import load_scenario

    folder = run_named(run)
    recorded = folder.is_dir() or is_recording(folder)
    if namespace and not recorded:
        raise KhrError(f'--namespace: {run} has no bag; accepted: the bag of several robots')
    scenario = load(folder, namespace=namespace).scenario if recorded else load_scenario(run)
    stem = of_robot(folder.name.removesuffix('.yaml'), namespace)
    file = out or Path(f'{stem}.csv')
    settings = write_motion(scenario.table(GaitParameters), file)
    print(file)
    print('play it with ' + ' '.join(f'--set {quote(each)}' for each in settings))


def _filmed(run: str) -> str:
    return str(run_named(run)) if run == 'last' else run
