"""The largest pushes of robot and model as CSV and Markdown.

``python -m khr_studies.push.page docs/models.md`` writes them into the models' document; it takes
a few minutes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, fields
from pathlib import Path

from khr_common.files import write_text
from khr_common.text.markdown import WrittenPart
from khr_report.page.document import Columns, Table, markdown, table
from khr_report.page.template import page_text
from khr_report.page.text import csv_text
from khr_sim.parameters import SimulatorParameters
from khr_studies.push.limits import (
    IMPULSE,
    ComplianceRow,
    MomentumRow,
    PushLimits,
    PushRow,
    measure_limits,
)
from khr_studies.push.model import legs
from khr_studies.push.study import START, TOLERANCE, WATCH, stance

MOMENTUM_COLUMNS: Columns[MomentumRow] = {
    'push, s': lambda row: f'{row.duration:g}',
    'robot, N s': lambda row: f'{row.survived:.3f} to {row.fatal:.3f}',
    'point mass, N s': lambda row: f'{row.point_mass:.3f}',
    'rigid body, N s': lambda row: f'{row.rigid_body:.3f}',
    f'COM carried by {IMPULSE:g} N s': lambda row: (
        'falls' if row.carried_mm is None else f'{row.carried_mm:.1f} mm'
    ),
}
COMPLIANCE_COLUMNS: Columns[ComplianceRow] = {
    'push, s': lambda row: f'{row.duration:g}',
    'robot, N': lambda row: f'{row.robot:.2f}',
    'with stiff servos, N': lambda row: f'{row.stiff_robot:.2f}',
    'rigid, closed form, N': lambda row: f'{row.rigid:.2f}',
    'model of its body, N': lambda row: f'{row.model:.2f}',
    'with a stiff servo, N': lambda row: f'{row.stiff_model:.2f}',
    'rigid point mass, closed form, N': lambda row: f'{row.rigid_point_mass:.2f}',
}


def largest_pushes(rows: Sequence[PushRow]) -> Table:
    """Make a table with a line per duration and body, and a column per loop."""
    loops = sorted(
        {(row.gain and row.gyro, row.gain) for row in rows},
        key=lambda loop: (loop[0] == 'circuit', loop[1]),
    )
    by_key = {(row.direction, row.duration, row.gain and row.gyro, row.gain): row for row in rows}
    directions = list(dict.fromkeys(row.direction for row in rows))
    lines = []
    whose = [
        (f'{who}, from {"the " * (side == "front")}{side}', side, forces)
        for side in directions
        for who, forces in (
            ('robot', ('survived', 'fatal')),
            ('model of its body', ('physical_robot',)),
        )
    ]
    whose += [
        (who, directions[0], (force,))  # a model survives as much from both sides
        for who, force in (
            ('model of its body, published', 'published_robot'),
            ("thesis's model, physical", 'physical_thesis'),
            ("thesis's model, published", 'published_thesis'),
        )
    ]
    for duration in dict.fromkeys(row.duration for row in rows):
        for name, direction, fields_ in whose:
            found = [by_key[direction, duration, *loop] for loop in loops]
            cells = (
                ' to '.join(f'{getattr(row, field):.2f}' for field in fields_) for row in found
            )
            lines.append((f'{duration:g} s', name, *cells))
    head = [f'K_A = {gain:g}' + (f', {gyro}' if gyro else '') for gyro, gain in loops]
    return Table(('push', 'who', *head), tuple(lines))


def document_part(found: PushLimits) -> str:
    """Return the part of the models' document on the robot."""
    own = stance()
    body, inertia = own.tipping('behind')
    return page_text(
        __name__,
        body=body,
        heels=own.tipping('front')[0].half_foot,
        inertia=inertia / (body.mass * (body.length**2 + body.half_foot**2)),
        servo=legs(own, SimulatorParameters()),
        pad_distance=SimulatorParameters().pad_distance,
        start=START,
        watch=WATCH,
        tolerance=TOLERANCE,
        pushes=largest_pushes(found.pushes),
        on_pads=largest_pushes(found.on_pads),
        momentum=table(found.momentum, MOMENTUM_COLUMNS),
        compliance=table(found.compliance, COMPLIANCE_COLUMNS),
    ).strip()


def write(rows: Sequence[PushRow], out: Path) -> list[Path]:
    """Write push.csv and push.md into a folder; return their paths."""
    names = [each.name for each in fields(PushRow)]
    texts = {
        out / 'push.csv': csv_text(names, map(astuple, rows), 4, '\n'),
        out / 'push.md': markdown([largest_pushes(rows)]) + '\n',
    }
    for path, text in texts.items():
        write_text(path, text)
    return list(texts)


PART = WrittenPart('khr_studies.push.page docs/models.md', lambda: document_part(measure_limits()))

if __name__ == '__main__':
    # by the module's own name, at which its template is
    from khr_studies.push import page

    page.PART.main()
