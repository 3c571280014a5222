"""The page of a reproduction: one file with all that it has found."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from khr_experiments.experiments import Runs
from khr_report.page.board import counts, judged
from khr_report.page.html import Section, data_uri, markdown, part, write_page
from khr_report.page.text import count, duration
from khr_report.reproduction import FigureResult, Reproduction

TITLE = 'Balanced walking of the KHR-3HV on an incline, reproduced'
BEYOND = 'Beyond the thesis'
CHAPTERS = {
    '3': 'Chapter 3: standing on one leg',
    '4': 'Chapter 4: the gyro, and pushes',
    '5': 'Chapter 5: walking',
}


def write_index(out: Path, contents: Reproduction) -> Path:
    """Write the page of a reproduction as ``index.html`` and return its path.

    It opens from a disk without a network: pictures are within; tables are too unless they lie
    in the same folder or below it.

    Args:
        out: folder of the page.
        contents: what to tell.

    Raises:
        ReportError: if the file cannot be written.
    """
    sections = [_verdict(contents)]
    if contents.scoreboard:
        sections.append(Section('Scoreboard', markdown(contents.scoreboard, out)))
    sections.append(_figures(contents, out))
    if contents.maps:
        sections.append(Section('Stability maps', _maps(contents, out)))
    if contents.lines:
        sections.append(Section('Origin of the spectral lines', markdown(contents.lines, out)))
    sections.append(_making(contents))
    return write_page(out / 'index.html', TITLE, part('paragraphs', _lead(contents)), sections)


def _lead(contents: Reproduction) -> list[str]:
    runs = len(contents.made)
    drawn = [figure for figure in (*contents.figures, *contents.maps) if not figure.error]
    lines = [
        'Dutta (2021), Study of Dynamic Control for Balanced Walking of Humanoid Robots, stood '
        'and walked a robot of 1.5 kg on an incline, held up by its ankles and hips.',
        'Here a simulated robot does the same, and every number on its side is measured: '
        f'{count(len(drawn), "figure")}, {count(runs, "run")} in '
        f'{count(len(contents.runs), "experiment")}, which took '
        f'{duration(contents.run_seconds)} of one core.',
    ]
    if contents.fast:
        return [*lines, 'This is the quick form: fewer seeds and points, so coarser limits.']
    return [*lines, 'What misses the thesis is shown like what agrees with it.']


def _verdict(contents: Reproduction) -> Section:
    summary = contents.scoreboard_summary or 'The scoreboard was not asked for'
    body = part('paragraphs', [f'{summary.rstrip(".")}.'])
    body += part('verdicts', counts(judged(contents.scoreboard)))
    failed = [
        f'{figure.number}: {figure.error}'
        for figure in (*contents.figures, *contents.maps)
        if figure.error
    ]
    return Section(
        'Verdict at a glance',
        body + part('notes', [f'could not be drawn: {each}' for each in failed]),
    )


def _figures(contents: Reproduction, out: Path) -> Section:
    chapters: dict[str, list[FigureResult]] = {}
    for figure in contents.figures:
        chapter = CHAPTERS.get(figure.number.split('.')[0], BEYOND)
        chapters.setdefault(chapter, []).append(figure)
    order = [title for title in (*CHAPTERS.values(), BEYOND) if title in chapters]
    return Section(
        'Figures',
        part(
            'paragraphs',
            [
                'Under each figure stand the command that draws it again and the table of what it shows.'
            ],
        ),
        tuple(Section(title, _all(chapters[title], out)) for title in order),
    )


def _all(figures: Sequence[FigureResult], out: Path) -> Markup:
    return Markup().join(_figure(figure, out) for figure in figures)


def _maps(contents: Reproduction, out: Path) -> Markup:
    return Markup().join(
        _figure(figure, out) + markdown(contents.tables.get(figure.number, ''), out)
        for figure in contents.maps
    )


def _figure(figure: FigureResult, out: Path) -> Markup:
    if figure.error:
        return part(
            'notes', [f'{figure.number}. {figure.title}: could not be drawn: {figure.error}']
        )
    experiments = ', '.join(figure.experiments)
    return part(
        'figure',
        figure.number,
        figure.title,
        data_uri(figure.image.read_bytes(), 'image/png'),
        _table_link(figure.table, out),
        figure.command,
        f'experiments: {experiments}' if experiments else 'from models',
    )


def _table_link(table: Path, out: Path) -> dict[str, str] | None:
    if not table.is_file():
        return None
    inside = out.resolve() in table.resolve().parents
    href = (
        os.path.relpath(table.resolve(), out.resolve())
        if inside
        else data_uri(table.read_bytes(), 'text/csv')
    )
    return {'name': table.name, 'href': href}


def _making(contents: Reproduction) -> Section:
    commands = [contents.command, *(figure.command for figure in contents.figures)]
    listed = Markup('<pre><code>{}</code></pre>').format('\n'.join(dict.fromkeys(commands)))
    seeds = [
        (name, len(runs), contents.seeds.get(name) or "the scenario's own")
        for name, runs in contents.runs.items()
    ]
    body = part(
        'paragraphs',
        [
            f'The command took {duration(contents.seconds)}, without what had been done before. The '
            'same versions give the same trajectories, bit for bit.'
        ],
    )
    body += part('folded', 'Commands: all of it, and each figure alone', listed)
    body += part('table', ['what', 'version'], sorted(contents.versions.items()))
    if seeds:
        body += part('table', ['experiment', 'runs', 'seeds'], seeds)
    for name, runs in contents.runs.items():
        body += part('folded', f'{name}: its runs and their trajectory hashes', _runs(runs))
    return Section('How it was made', body)


def _runs(runs: Runs) -> Markup:
    axes = list(dict.fromkeys(axis for run in runs for axis in run.point))
    rows = [
        [*(_short(run.point.get(axis)) for axis in axes), _short(run.seed), *_result(run.row)]
        for run in runs
    ]
    return part(
        'table', [*axes, 'seed', 'outcome', 'trajectory hash'], rows, {'trajectory hash': 'hash'}
    )


def _result(row: dict[str, Any]) -> tuple[Any, Any]:
    if row.get('error'):
        return f'could not be run: {row["error"]}', ''
    fell = row.get('fell_at_s')
    when = f' at {fell:.2f} s' if row.get('verdict') == 'fell' and fell is not None else ''
    return f'{row.get("verdict") or "unknown"}{when}', escape(row.get('trajectory_hash') or '')


def _short(value: Any) -> str:
    return '' if value is None else f'{value:g}' if isinstance(value, float) else str(value)
