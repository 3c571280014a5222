"""``khr report``: a page about one run, or about two compared."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from markupsafe import Markup

from khr_analysis.outcome_values import LABELS, Value, shown
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.bout.result import FILE as OF_BOUT
from khr_bringup.code_version import code_version, version_of, versions_of_run
from khr_bringup.node_registry import registry
from khr_bringup.recorded.events import Event, fall_in
from khr_bringup.recorded.recorded_run import ACCEPTED
from khr_bringup.recorded.run_signals import Series
from khr_bringup.result import NO_HASH
from khr_bringup.run_folder import SCENARIO, of_robot
from khr_bringup.scenario.derived import derived, swings
from khr_common import specifications
from khr_common.errors import KhrError, one_line
from khr_common.signals import broken
from khr_report.output import csv_text
from khr_report.page.html import Section, data_uri, paragraphs, part, write_page
from khr_report.plots.plot_style import panels, styled
from khr_report.run.contents import RunContents, contents_of, is_foreign
from khr_report.run.overview import CHANGED, from_above, note, over_time, robot_named
from khr_report.run.panes import panes_of
from khr_report.run.recording_page import picture, report_recording
from khr_report.run.spectra import draw_spectra, spectrogram, spectrum_of_run
from khr_sweeps.trial import complete

HASH = 'trajectory_hash'
OUTCOME = {'verdict': 'outcome', 'end': 'ended by', **LABELS, HASH: 'trajectory hash'}
FILES = ('scenario.yaml', 'outcome.json', 'overview.png', 'report.html', 'film.mp4')
Found = Mapping[str, RunContents]  # one as ``this run``, or two as ``A`` and ``B``


def report(
    run: Path,
    against: Path | None = None,
    out: Path | None = None,
    topic: str = '',
    axis: str = '',
    namespace: str = '',
) -> Path:
    """Write the page of a run, beside another if there is one; return its path.

    The page shows the parts that can be read; it and stderr list the missing ones.

    Args:
        run: the folder of a run, or its bag.
        against: another.
        out: the page; in the run's folder by default, as ``report.html``, of a robot in a
            namespace as ``report_blue.html``.
        topic, axis: of the signal to show of a recording that is no run of khr.
        namespace: of the robot, in a recording of several.

    Raises:
        KhrError: if a run has nothing to show, or the page cannot be written.
    """
    folder = run if run.is_dir() else run.parent
    page = out or folder / f'{of_robot("report", namespace)}.html'
    if against is not None and (topic or axis):
        raise KhrError(f'{"--topic" if topic else "--axis"}: not accepted with --against')
    if topic or axis or (against is None and is_foreign(run, namespace)):
        return report_recording(run, page, topic, axis, namespace)
    paths = {'this run': run} if against is None else {'A': run, 'B': against}
    for path in paths.values():
        if against is not None and is_foreign(path, namespace):
            raise KhrError(f'{path}: no khr run; accepted with --against: two khr runs')
    found = {name: contents_of(path, namespace) for name, path in paths.items()}
    for each in found.values():
        if each.record is None and each.series is None:
            reasons = '; '.join(each.notes)
            raise KhrError(f'{each.folder}: neither outcome nor signals ({reasons}); {ACCEPTED}')
    warnings = [f'{each.name}: {note}' for each in found.values() for note in each.notes]
    if len(found) == 2 and (other := _difference(*found.values())):
        warnings.insert(0, other)
    for warning in warnings:
        print(f'khr: {warning}', file=sys.stderr)
    return write_run(page, found, warnings)


def write_run(path: Path, found: Found, warnings: Sequence[str]) -> Path:
    """Write the page of one run, or of two compared; return its path."""
    title = ' against '.join(
        f'{run.name}, {run.robot}' if run.robot else run.name for run in found.values()
    )
    titles = [
        f'{name}: ' * (len(found) == 2)
        + f'{run.title}{robot_named(run.robot)}{CHANGED * bool(run.changes)} ({run.name}).'
        for name, run in found.items()
    ]
    lead = paragraphs(*titles) + part('notes', warnings)
    sections = [
        Section('Outcome', _outcome(found)),
        Section('Signals', _signals(found)),
        Section('Spectrum', _spectrum(found)),
        Section('Parameters', _parameters(found)),
        Section('How it was made', _making(found, path)),
    ]
    return write_page(path, f'Run {title}', lead, sections)


def _outcome(found: Found) -> Markup:
    if not any(run.record for run in found.values()):
        return paragraphs('Unknown: the run has no outcome file.')
    outcomes = [run.record.to_json() if run.record else {} for run in found.values()]
    rows = [
        [text, *(_value(name, outcome.get(name, '')) for outcome in outcomes)]
        for name, text in OUTCOME.items()
        if name == HASH or any(outcome.get(name, '') != '' for outcome in outcomes)
    ]
    heads = ['quantity', *found]
    if len(found) == 2:
        heads.append('B - A')
        rows = [[*row, _step(row[1], row[2])] for row in rows]
    return part('table', heads, rows, dict.fromkeys(found, 'value'))


def _value(name: str, value: Value) -> str:
    return NO_HASH if name == HASH and not value else shown(name, value)


def _step(before: str, after: str) -> str:
    """Write the difference of two numbers with the decimals of the second."""
    try:
        decimals = len(after.partition('.')[2])
        return f'{float(after) - float(before):+.{decimals}f}'
    except ValueError:
        return 'same' if before == after else 'differs'


def _signals(found: Found) -> Markup:
    runs = [(name, run, run.series) for name, run in found.items() if run.series is not None]
    if not runs:
        return paragraphs('The run kept no signals.')
    windows = {name: spectrogram(series, run.parameters) for name, run, series in runs}
    short = [name for name, each in windows.items() if len(each) <= 1]
    shown = {
        f'Spectrogram of the gyro, {name}': each
        for name, each in windows.items()
        if name not in short
    }
    with styled():
        gaits = [run.parameters.table(GaitParameters) for _, run, _ in runs]
        alike = all(swings(each) == swings(gaits[0]) for each in gaits)
        events = _named_events(found)
        signals = {name: series for name, _, series in runs}
        if not (shown or panes_of(signals)):
            return paragraphs('The signals of the run are zero throughout.')
        figure, titles = over_time(signals, shown, gaits[0] if alike else None, events)
        above = from_above(found)
    body = picture('; '.join(titles), figure)
    if above is not None:
        body += picture('The balance from above, over the loaded soles of each step', above)
    texts = dict.fromkeys(note(run.parameters, alike).capitalize() for _, run, _ in runs)
    body += paragraphs(
        *(f'{text}. Signals that are zero throughout are left out.' for text in texts)
    )
    body += paragraphs(*(f'Too short for a spectrogram: {name}.' for name in short))
    for name, _, series in runs:
        body += Markup(
            '<p><a download="{}.csv" href="{}">Signals of {} (CSV, with units)</a></p>'
        ).format(
            of_robot(found[name].name, found[name].robot), data_uri(_csv(series), 'text/csv'), name
        )
    return body


def _named_events(found: Found) -> list[Event]:
    """Return the events in their order, of two runs each with the name of its run."""
    named = [
        replace(event, text=f'{name}: {event.text}') if len(found) > 1 else event
        for name, run in found.items()
        if run.series is not None
        for event in run.events
    ]
    return sorted(named, key=lambda event: event.time)


def _spectrum(found: Found) -> Markup:
    lines = {
        name if len(found) == 2 else '': spectrum_of_run(
            run.series, run.parameters, fall_in(run.events)
        )
        for name, run in found.items()
        if run.series is not None
    }
    if not lines:
        return paragraphs('The run kept no signals.')
    with styled():
        figure, (axis,) = panels('', height=3.0)
        draw_spectra(axis, lines)
    shown = '; '.join(
        f'{name}: {each.text}' if name else each.text for name, each in lines.items()
    )
    return picture(f'Spectrum of the gyro; {shown}', figure)


def _parameters(found: Found) -> Markup:
    known = {name: complete(run.scenario) for name, run in found.items() if run.scenario}
    if not known:
        return paragraphs('Unknown: the run has no scenario file.')
    rows = []
    shown = {'simulator', *(node for run in found.values() for node in run.parameters.nodes)}
    for node, registered in registry().items():
        if node not in shown:
            continue
        follows = [derived(run.parameters.values, node) for run in found.values() if run.scenario]
        for key, specification in specifications(registered.spec.table).items():
            if specification.wiring:
                continue
            values = [every[node][key] for every in known.values()]
            default = specification.default
            usual = [each.get(key, default) for each in follows]
            if any(value not in (default, own) for value, own in zip(values, usual, strict=True)):
                meaning = (default, specification.unit, specification.description)
                rows.append((f'{node}.{key}', *values, *meaning))
    heads = ('parameter', *known, 'default', 'unit', 'meaning')
    looks = dict.fromkeys((*known, 'default'), 'value') | {'meaning': 'meaning'}
    body = Markup()
    if len(known) == 2:
        differing = [row for row in rows if row[1] != row[2]]
        body += Markup('<h3>Differences between A and B</h3>')
        body += _table(heads, differing, looks)
    body += Markup('<h3>Differences from the defaults</h3>')
    body += _table(heads, rows, looks)
    body += Markup('<h3>Changes while it ran</h3>')
    for name, run in found.items():
        changed = [
            (f'{each.time:.3f}', f'{each.node}.{each.parameter}', each.value)
            for each in run.changes
        ]
        heads = ('time, s', f'parameter of {name}', 'set to')
        body += _table(heads, changed, {}, f'{name}: none recorded.')
        if run.pushes:
            pushes = [(f'{each.time:.3f}', each.text) for each in run.pushes]
            body += _table(('time, s', f'push of {name}'), pushes, {})
    return body


def _table(
    heads: Sequence[str], rows: Sequence[Any], looks: dict[str, str], nothing: str = 'Nothing.'
) -> Markup:
    lines = [[one_line(c) if isinstance(c, str) and '\n' in c else c for c in row] for row in rows]
    return part('table', heads, lines, looks) if rows else paragraphs(nothing)


def _making(found: Found, page: Path) -> Markup:
    runs = found.values()
    here = next((version_of(run.scenario) for run in runs if run.scenario), code_version())
    recorded = {name for run in runs for name in run.made_with}
    versions = [
        ('khr code', *(run.version or 'not recorded' for run in runs), here),
        *(
            (name, *(run.made_with.get(name, 'not recorded') for run in runs), number)
            for name, number in versions_of_run().items()
            if name in recorded or not recorded
        ),
    ]
    return (
        paragraphs(
            '"khr report" wrote this page from the files of each run; it loads nothing '
            'from the network. Run again, a scenario takes the same trajectory, bit for bit, in '
            'the same arithmetic with the same versions; "khr verify" compares the hash of a bag. '
            'The code version takes in NumPy and the physics engine.'
        )
        + part('table', ('version', *found, 'here'), versions)
        + Markup().join(
            part('links', f'Files of {name}', _files(run, page)) for name, run in found.items()
        )
        + Markup().join(
            part(
                'folded',
                f'Scenario of {name}, whole',
                Markup('<pre><code>{}</code></pre>').format(run.scenario.to_yaml()),
            )
            for name, run in found.items()
            if run.scenario
        )
    )


def _files(run: RunContents, page: Path) -> list[tuple[str, str]]:
    """Return names and addresses of a run's files beside the page; other pages among them."""
    paths = [run.folder / name for name in FILES]
    paths += sorted(run.folder.glob('report_*.html'))
    paths += [run.bout / name for name in (SCENARIO, OF_BOUT)] if run.bout else []
    place = page.resolve()
    return [
        (path.name, os.path.relpath(path.resolve(), place.parent))
        for path in paths
        if path.is_file() and path.resolve() != place
    ]


def _csv(series: Series) -> bytes:
    """Return the signals as CSV with units, angles in deg, one column per number."""
    times, *others = (columns := series.with_units).values()
    rows = zip(*broken(times, others), strict=True)
    return csv_text(columns, rows, 9).encode()


def _difference(one: RunContents, other: RunContents) -> str:
    """Return a warning if two runs are of different scenarios, else nothing."""
    names = [each.scenario_name or each.title for each in (one, other)]
    if names[0] == names[1]:
        return ''
    return f'the runs are of different scenarios: {names[0]}, and {names[1]}'
