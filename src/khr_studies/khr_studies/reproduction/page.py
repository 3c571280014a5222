"""The page of a reproduction: all results in one file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from markupsafe import Markup

from khr_common.files import write_text
from khr_report.page.document import count, duration, html
from khr_report.page.html import Section, data_uri, paragraphs, part, write_page
from khr_studies.measuring.experiments import Runs, group_by
from khr_studies.measuring.json_file import write_json
from khr_studies.peak_origin import page as peak_origin_page
from khr_studies.reproduction import findings_page
from khr_studies.reproduction.pictures import FigureResult
from khr_studies.reproduction.reproduce import Reproduction
from khr_studies.scoreboard import page as scoreboard_page
from khr_studies.stability_map import page as map_page

TITLE = 'Balanced walking of the KHR-3HV on a slope, reproduced'
DOCUMENTS = ('findings.md', 'findings.json', 'scoreboard.md', 'scoreboard.json')
BEYOND = 'Beyond the thesis'
CHAPTERS = {
    '3': 'Chapter 3: standing on one leg',
    '4': 'Chapter 4: the gyro, and pushes',
    '5': 'Chapter 5: walking',
}


def write(results: Reproduction, out: Path, findings: Path) -> str:
    """Write page, findings and scoreboard; return a summary of one line.

    Args:
        out: folder of the page and of the scoreboard.
        findings: Markdown file of the findings; a JSON file is written to the same folder.
    """
    found, drawn = results.findings, results.drawn
    write_json(findings.with_suffix('.json'), found)
    write_text(findings, findings_page.findings_markdown(found))
    board = 'not asked for'
    if found.scoreboard:
        board = scoreboard_page.write(found.scoreboard, out / 'scoreboard.md')
    return (
        f'{write_index(out, results)}: {sum(not each.error for each in drawn)} of {len(drawn)} '
        f'figures, {count(found.runs, "run")}, scoreboard: {board}; {duration(results.seconds)}'
    )


def write_index(out: Path, results: Reproduction) -> Path:
    """Write the page of a reproduction as ``index.html`` and return its path.

    The page needs no network: it contains its pictures, and links to CSV files in its folder alone.
    """
    board = results.findings.scoreboard
    sections = [
        _verdict(results),
        Section('Findings', html(findings_page.blocks(results.findings))),
    ]
    if board:
        sections.append(Section('Scoreboard', html(scoreboard_page.blocks(board))))
    sections.append(_figures(results, out))
    if results.maps:
        sections.append(Section('Stability maps', _maps(results, out)))
    if results.peaks:
        origin = html(peak_origin_page.blocks(results.peaks))
        sections.append(Section('Origin of the spectral peaks', origin))
    sections.append(_making(results, out))
    return write_page(out / 'index.html', TITLE, paragraphs(*_lead(results)), sections)


def _lead(results: Reproduction) -> list[str]:
    drawn = [figure for figure in results.drawn if not figure.error]
    lines = [
        'Dutta (2021), Study of Dynamic Control for Balanced Walking of Humanoid Robots, let a '
        'robot of 1.5 kg stand and walk on a slope, balanced by its ankles and hips.',
        'Here a simulated robot does the same. The page shows '
        f'{count(len(drawn), "figure")}, {count(results.findings.runs, "run")} in '
        f'{count(len(results.runs), "experiment")}, which took '
        f'{duration(results.findings.run_seconds)} of one core.',
    ]
    if results.findings.fast:
        return [*lines, 'This is the quick form: fewer seeds and points, so coarser limits.']
    return lines


def _verdict(results: Reproduction) -> Section:
    board = results.findings.scoreboard
    if board:
        body = paragraphs(f'{scoreboard_page.summary(board)}.')
        body += part('verdicts', scoreboard_page.counts(board))
    else:
        body = paragraphs('The scoreboard was not measured.')
    if results.ragged:
        title = 'Ragged limits: lost below an inclination at which the robot stays up'
        body += part('folded', title, part('bullets', results.ragged))
    failed = [f'{figure.number}: {figure.error}' for figure in results.drawn if figure.error]
    return Section(
        'Verdict at a glance',
        body + part('notes', [f'could not be drawn: {each}' for each in failed]),
    )


def _figures(results: Reproduction, out: Path) -> Section:
    chapters = group_by(
        results.figures, lambda figure: CHAPTERS.get(figure.number.split('.')[0], BEYOND)
    )
    order = [title for title in (*CHAPTERS.values(), BEYOND) if title in chapters]
    return Section(
        'Figures',
        paragraphs(
            'Below each figure are the command that draws it again and the CSV of its points.'
        ),
        tuple(
            Section(title, Markup().join(_figure(figure, out) for figure in chapters[title]))
            for title in order
        ),
    )


def _maps(results: Reproduction, out: Path) -> Markup:
    found = results.findings.maps
    return Markup().join(
        _figure(figure, out)
        + html(map_page.blocks(found[figure.number]) if figure.number in found else [])
        for figure in results.maps
    )


def _figure(figure: FigureResult, out: Path) -> Markup:
    if figure.error:
        return part(
            'notes', [f'{figure.number}. {figure.title}: could not be drawn: {figure.error}']
        )
    experiments = Markup(', ').join(
        Markup('<a href="#runs-{0}">{0}</a>').format(name) for name in figure.experiments
    )
    return part(
        'figure',
        figure.number,
        figure.title,
        data_uri(figure.image.read_bytes(), 'image/png'),
        _csv_link(figure.points, out),
        figure.command,
        Markup('from the runs of {}').format(experiments) if experiments else 'from models',
    )


def _csv_link(points: Path, out: Path) -> dict[str, str] | None:
    if not points.is_file():
        return None
    inside = out.resolve() in points.resolve().parents
    href = (
        os.path.relpath(points.resolve(), out.resolve())
        if inside
        else data_uri(points.read_bytes(), 'text/csv')
    )
    return {'name': points.name, 'href': href}


def _making(results: Reproduction, out: Path) -> Section:
    commands = [results.findings.command, *(figure.command for figure in results.figures)]
    listed = Markup('<pre><code>{}</code></pre>').format('\n'.join(dict.fromkeys(commands)))
    seeds = [
        (name, len(runs), results.seeds.get(name) or "the scenario's own")
        for name, runs in results.runs.items()
    ]
    body = paragraphs(
        f'"{results.findings.command}" measured all results, drew the pictures and wrote this '
        f'page in {duration(results.seconds)}; stored results were reused. The same versions give '
        'the same trajectories, bit for bit. The page loads nothing from the network.'
    )
    body += part(
        'links',
        'The same as documents and as data',
        [(name, name) for name in DOCUMENTS if (out / name).is_file()],
    )
    body += part('folded', 'Commands: the whole page, and each figure', listed)
    body += part('table', ['component', 'version'], sorted(results.findings.versions.items()))
    if seeds:
        body += part('table', ['experiment', 'runs', 'seeds'], seeds)
    for name, runs in results.runs.items():
        title = f'{name}: its runs and their trajectory hashes'
        body += part('folded', title, _runs(runs), f'runs-{name}')
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


def _result(row: dict[str, Any]) -> tuple[str, str]:
    if row.get('error'):
        return f'could not be run: {row["error"]}', ''
    fell = row.get('fell_at_s')
    when = f' at {fell:.2f} s' if row.get('verdict') == 'fell' and fell is not None else ''
    return f'{row.get("verdict") or "unknown"}{when}', row.get('trajectory_hash') or ''


def _short(value: Any) -> str:
    return '' if value is None else f'{value:g}' if isinstance(value, float) else str(value)
