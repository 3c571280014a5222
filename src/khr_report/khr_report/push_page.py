"""The largest pushes of robot and model as CSV and Markdown.

``python -m khr_report.push_page docs/models.md`` writes them into the models' document; it takes
a few minutes.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path

from khr_common.files import write_text
from khr_common.markdown import put_between, rewrite_document
from khr_experiments.push_limits import (
    DURATIONS,
    IMPULSE,
    PADS,
    SHORT,
    ComplianceRow,
    MomentumRow,
    PushRow,
    compliance,
    conditions,
    measure_all,
    momentum,
)
from khr_experiments.push_model import legs
from khr_experiments.push_recovery import START, TOLERANCE, WATCH, stance
from khr_report.page.document import Columns, Table, markdown, table
from khr_sim.parameters import SimulatorParameters

BEGIN = '<!-- begin: written by python -m khr_report.push_page docs/models.md -->'
END = '<!-- end of the robot -->'
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


def csv_of(rows: Iterable[PushRow]) -> str:
    """Return rows as CSV; the columns are the fields of PushRow."""
    names = [field.name for field in fields(PushRow)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(names)
    for row in rows:
        values = (getattr(row, name) for name in names)
        writer.writerow(f'{value:.4g}' if isinstance(value, float) else value for value in values)
    return text.getvalue()


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
        (who, directions[0], (force,))  # the same from both sides
        for who, force in (
            ('model of its body, published', 'published_robot'),
            ("thesis's model, physical", 'physical_thesis'),
            ("thesis's model, published", 'published_thesis'),
        )
    ]
    for duration in dict.fromkeys(row.duration for row in rows):
        for name, direction, fields_ in whose:
            found = [by_key[direction, duration, *loop] for loop in loops]
            lines.append(
                [
                    f'{duration:g} s',
                    name,
                    *(
                        ' to '.join(f'{getattr(row, field):.2f}' for field in fields_)
                        for row in found
                    ),
                ]
            )
    head = [f'K_A = {gain:g}' + (f', {gyro}' if gyro else '') for gyro, gain in loops]
    return Table(('push', 'who', *head), tuple(map(tuple, lines)))


def document_part() -> str:
    """Return the part of the models' document on the robot."""
    own = stance()
    pid = legs(own, SimulatorParameters())
    body, inertia = own.tipping('behind')
    on_pads = conditions(durations=DURATIONS[:1], gyros=('packaged',), changes=PADS)
    point_mass = body.mass * (body.length**2 + body.half_foot**2)
    return '\n\n'.join(
        [
            '### The same pushes on the simulated robot',
            f'The robot stands on rubber soles on the flat, its centre of mass {1e3 * body.length:.0f}'
            f' mm over the soles, {1e3 * body.half_foot:.1f} mm behind the toes and '
            f'{1e3 * own.tipping("front")[0].half_foot:.1f} mm ahead of the heels. Its inertia about '
            f'the toes is {inertia / point_mass:.2f} times that of a point mass; its legs give to a '
            f'push as would a servo at the ground with {pid.proportional:.1f} N m/rad. At {START:g} s '
            'the force begins to act on the torso, at the centre of mass; the robot is watched for '
            f'{WATCH:g} s after it ends. Forces in N: of the robot the largest survived and the '
            f'smallest fatal one that were tried, {100 * TOLERANCE:.2g} % apart at most; of the model '
            'the largest that it survives. "Model of its body" is the physical form with the '
            "robot's mass, height, sole and stance, on that servo.",
            markdown([largest_pushes(measure_all(conditions()))]),
            f'On the force-sensor pads, {2e3 * SimulatorParameters().pad_distance:.0f} mm from heel '
            'to toe, near the b/l of the thesis:',
            markdown([largest_pushes(measure_all(on_pads))]),
            'The momentum argument, without control, from behind:',
            markdown([table(map(momentum, SHORT), MOMENTUM_COLUMNS)]),
            'Compliance, without control, from behind:',
            markdown([table(map(compliance, DURATIONS), COMPLIANCE_COLUMNS)]),
        ]
    )


def rewrite(text: str) -> str:
    """Replace the part between the markers.

    Raises:
        KhrError: if a marker is missing.
    """
    return put_between(text, BEGIN, END, document_part())


def write(rows: Sequence[PushRow], out: Path) -> list[Path]:
    """Write push.csv and push.md into a folder; return their paths."""
    texts = {
        out / 'push.csv': csv_of(rows),
        out / 'push.md': markdown([largest_pushes(rows)]) + '\n',
    }
    for path, text in texts.items():
        write_text(path, text)
    return list(texts)


def main() -> None:
    """Rewrite the document named on the command line."""
    rewrite_document(rewrite)


if __name__ == '__main__':
    main()
