"""What a reproduction says to a researcher, on one page: confirmed, contradicted, added.

Every number and every verb comes from the reproduction, so that the page stays true when the
robot is calibrated anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from statistics import fmean

from khr_report.page.board import Judged, Row, explained, judged
from khr_report.page.text import duration
from khr_report.page.trials import added
from khr_report.reproduction import Reproduction

ABSENT = 'Nothing that was measured does.'
SURVIVES = 'does not fall'  # as the scoreboard tells it


def findings(contents: Reproduction) -> str:
    """Return the page in Markdown."""
    rows = judged(contents.scoreboard)
    why = explained(contents.scoreboard)
    parts = [
        '# Findings',
        _question(contents, rows),
        '## What the simulation confirms',
        _list(_told(rows, True, why)),
        '## What it contradicts',
        _list(_told(rows, False, why)),
        '## What it adds',
        _list([*_unpublished(rows), *_moved(why), *added(contents.runs), *_lines(contents)]),
        '## How to repeat it',
        _repeat(contents),
    ]
    return '\n\n'.join(parts) + '\n'


def _question(contents: Reproduction, rows: Sequence[Judged]) -> str:
    text = (
        'Written by `khr reproduce`; do not edit. Dutta (2021) let a robot of 1.5 kg stand '
        'and walk on an incline: without control it falls beyond a critical inclination; toe '
        'and heel force or the gyro fed back to the ankles, and the gyro to the hips, raise '
        'that limit, and vibration is the price. **Does a simulated robot, made of published '
        'constants and a few fitted ones, come to the same?**'
    )
    with_number = [row for row in rows if row.passed is not None]
    if not with_number:
        return f'{text} The scoreboard was not measured, so the rows of the thesis are not judged.'
    predicted = [row for row in with_number if not row.fitted]
    return (
        f'{text} Of {len(with_number)} rows of the thesis {_passed(with_number)} agree; of '
        f'the {len(predicted)} among them that no calibration has seen, {_passed(predicted)}.'
        + (' This was the quick form, with few seeds.' if contents.fast else '')
    )


def _passed(rows: Iterable[Judged]) -> int:
    return sum(bool(row.passed) for row in rows)


def _told(rows: Sequence[Judged], passed: bool, why: Sequence[Row]) -> list[str]:
    """Tell the rows that agree, or those that do not, each kind of table in its own way."""
    chosen = [row for row in rows if row.passed is passed]
    tellers: dict[str, Callable[[list[Judged], bool, Sequence[Row]], list[str]]] = {
        'condition': _limits,
        'control': _walks,
        'at phi, deg': _trends,
        'thesis': _plain,
    }
    lines = []
    for head, tell in tellers.items():
        some = [
            row for row in chosen if next(each for each in tellers if each in row.cells) == head
        ]
        lines += tell(some, passed, why) if some else []
    return lines


def _limits(rows: list[Judged], passed: bool, why: Sequence[Row]) -> list[str]:
    best = {row['condition']: row['closest to the thesis'] for row in why}
    lines = []
    for row in rows:
        cells, ours = row.cells, row.cells['simulation'].partition(';')[0]
        if 'order' in cells['condition']:
            lines.append(
                f'**{_capital(cells["condition"])}** ({cells["thesis"]}): '
                f'{"it holds" if passed else "it does not hold"}, {ours} deg.'
            )
            continue
        text = (
            f'**{_capital(cells["condition"])}**: {"limit" if passed else _sooner(cells)} '
            f'{ours} deg, in the thesis {cells["thesis"]}'
        )
        text += f' ({cells["kind"]})' if passed else f' ({cells["difference"]})'
        if not passed and cells['condition'] in best:
            found = best[cells['condition']]
            text += (
                '; no change that was tried comes closer'
                if found == 'none of them'
                else f'; closest with {found} deg'
            )
        lines.append(f'{text}.')
    return lines


def _sooner(cells: Row) -> str:
    return 'it falls sooner, at' if cells['difference'].startswith('-') else 'it holds longer, to'


def _walks(rows: list[Judged], passed: bool, _: Sequence[Row]) -> list[str]:
    fell = [row for row in rows if _most_fall(row.cells)]
    unlike = [row for row in rows if row.cells['difference'] == SURVIVES]
    stayed = [row for row in rows if row not in fell and row not in unlike]
    lines = []
    if fell:
        meant = 'It falls, as in the thesis' if passed else 'It falls where the thesis walked'
        lines.append(f'**{meant}**: at {_places(fell)}.')
    if unlike:
        lines.append(f'**It walks where the thesis fell**: at {_places(unlike)}.')
    if stayed and passed:
        lines.append(
            '**It walks, as in the thesis**, with the slip and the peaks published '
            f'there: at {_places(stayed)}.'
        )
    lines += [
        f'**At {_place(row.cells)} it walks**, but {row.cells["difference"]} '
        f'(the thesis: {row.cells["thesis"]}).'
        for row in stayed
        if not passed
    ]
    return lines


def _most_fall(cells: Row) -> bool:
    fallen, _, seeds = cells['falls'].partition(' of ')
    return 2 * int(fallen) > int(seeds)


def _place(cells: Row) -> str:
    return f'{cells["phi, deg"]} deg ({cells["control"]})'


def _places(rows: Sequence[Judged]) -> str:
    return ', '.join(_place(row.cells) for row in rows)


def _trends(rows: list[Judged], passed: bool, _: Sequence[Row]) -> list[str]:
    told = '; '.join(
        f'{row.cells["what"]} ({row.cells["simulation"]} at {row.cells["at phi, deg"]} deg)'
        for row in rows
    )
    return [f'**Trends {"found" if passed else "not found"}**: {told}.']


def _plain(rows: list[Judged], passed: bool, _: Sequence[Row]) -> list[str]:
    if passed:
        told = '; '.join(f'{row.cells["what"]}: {row.cells["thesis"]}' for row in rows)
    else:
        told = '; '.join(
            f'{row.cells["what"]}: {row.cells["simulation"]}, not {row.cells["thesis"]}'
            for row in rows
        )
    return [f'**Standing on one leg**: {told}.']


def _unpublished(rows: Sequence[Judged]) -> list[str]:
    """Tell the walks that the thesis asks for without a result of its own."""
    told = []
    for row in rows:
        cells = row.cells
        if row.passed is None and 'falls' in cells:
            ends = (
                f'falls ({cells["falls"]} seeds)'
                if _most_fall(cells)
                else f'walks, slip {cells["slip, mm"]} mm, vibration {cells["vibration, rad/s"]} '
                'rad/s'
            )
            told.append(f'at {_place(cells)} it {ends}')
    return [f'**Left open by the thesis**: {"; ".join(told)}.'] if told else []


def _moved(why: Sequence[Row]) -> list[str]:
    """Tell what each change of the robot does to the limits that miss."""
    told = []
    for head in dict.fromkeys(head for row in why for head in row):
        shifts = [float(row[head]) for row in why if row.get(head, '')[:1] in ('+', '-')]
        if shifts:
            told.append((fmean(shifts), head))
    if not told:
        return []
    listed = ', '.join(
        f'{name} {shift:+.2f}' for shift, name in sorted(told, key=lambda each: -abs(each[0]))
    )
    return [
        f'**What moves the limits that miss**, in deg on average, by one seed, the strongest '
        f'first: {listed}.'
    ]


def _lines(contents: Reproduction) -> list[str]:
    """Quote what the section on the spectral lines begins with."""
    paragraphs = [each.strip() for each in contents.lines.split('\n\n')]
    first = next((each for each in paragraphs if each and each[0] not in '#|!-'), '')
    return [f'**Origin of the spectral lines**: {" ".join(first.split())}'] if first else []


def _repeat(contents: Reproduction) -> str:
    versions = ', '.join(f'{name} {version}' for name, version in contents.versions.items())
    return (
        f'`{contents.command}` repeats all of it: {len(contents.figures)} figures and '
        f'{len(contents.made)} runs, which took {duration(contents.run_seconds)} of one core. '
        f'With the same versions ({versions}) every run takes the same trajectory, bit for '
        'bit; the page that it writes tells the hash of each.'
    )


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _list(lines: Sequence[str]) -> str:
    return '\n'.join(f'- {line}' for line in lines) if lines else ABSENT
