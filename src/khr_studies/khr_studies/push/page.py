"""The largest pushes of robot and model as CSV and Markdown.

``python -m khr_studies.push.page docs/models.md`` writes them into the models' document; it takes
a few minutes.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields, replace
from pathlib import Path

from khr_common.files import write_text
from khr_common.text.markdown import WrittenPart
from khr_models.standing.ankle_servo import Pid
from khr_models.standing.push import capture_force
from khr_models.standing.push import largest_push as largest_of_model
from khr_report.page.document import Table, markdown
from khr_report.page.template import page_text
from khr_sim.parameters import SimulatorParameters
from khr_studies.measuring.condition import Changes, stiffer_pid
from khr_studies.push.limits import DURATIONS, PushRow, conditions, measure_all
from khr_studies.push.model import legs, model_loop, model_push
from khr_studies.push.study import (
    START,
    TOLERANCE,
    WATCH,
    PushCondition,
    largest_push,
    push_robot,
    stance,
)

SHORT = (0.02, 0.05, *DURATIONS)  # s, of the momentum argument
IMPULSE = 0.6  # N s, compared over durations
# Servos four times as stiff; still stiffer ones chatter after the push.
STIFF: Changes = ((('simulator', 'stiffness_per_stretch'), 1.0), *stiffer_pid(4.0))
STIFFER = 20.0  # times, of the model's servo
PADS: Changes = ((('simulator', 'surface'), 'pads'),)


def csv_of(rows: Iterable[PushRow]) -> str:
    """Return rows as CSV; the columns are the fields of PushRow."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(field.name for field in fields(PushRow))
    for row in map(astuple, rows):
        writer.writerow(f'{value:.4g}' if isinstance(value, float) else value for value in row)
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


def momentum(duration: float) -> dict[str, str]:
    """Measure the largest impulse without control, from behind, for one duration in s.

    Beside it stand closed forms, by conservation of momentum, and how far IMPULSE carries the
    centre of mass.

    Returns:
        The cells of a line, by the head of their column.
    """
    own, inertia = stance().tipping('behind')
    condition = PushCondition(duration=duration)
    found = largest_push(condition)
    response = push_robot(condition, IMPULSE / duration)
    carried = 1e3 * float(response.x_com.max() - response.x_com[0])
    return {
        'push, s': f'{duration:g}',
        'robot, N s': f'{duration * found.survived:.3f} to {duration * found.fatal:.3f}',
        'point mass, N s': f'{duration * capture_force(own, own.inertia, duration):.3f}',
        'rigid body, N s': f'{duration * capture_force(own, inertia, duration):.3f}',
        f'COM carried by {IMPULSE:g} N s': 'falls' if response.fell else f'{carried:.1f} mm',
    }


def compliance(duration: float) -> dict[str, str]:
    """Measure the largest push without control, from behind, with soft and with stiff servos.

    Args:
        duration: of the push, s.

    Returns:
        The cells of a line, by the head of their column.
    """
    soft, hard = (PushCondition(duration=duration, changes=changes) for changes in ((), STIFF))
    edge, inertia = stance(hard.base()).tipping('behind')
    loop = model_loop(soft, 'physical', 'robot')
    pid = Pid(STIFFER * loop.pid.proportional, 0.0, STIFFER * loop.pid.derivative)
    forces = {
        'robot': largest_push(soft).middle,
        'with stiff servos': largest_push(hard).middle,
        'rigid, closed form': capture_force(edge, inertia, duration),
        'model of its body': model_push(soft, 'physical', 'robot'),
        'with a stiff servo': largest_of_model(
            replace(loop, pid=pid), duration=duration, watch=WATCH
        ),
        'rigid point mass, closed form': capture_force(edge, edge.inertia, duration),
    }
    return {
        'push, s': f'{duration:g}',
        **{f'{who}, N': f'{force:.2f}' for who, force in forces.items()},
    }


def _table(lines: Sequence[dict[str, str]]) -> Table:
    return Table(tuple(lines[0]), tuple(tuple(line.values()) for line in lines))


def document_part() -> str:
    """Measure the part of the models' document on the robot, which takes minutes; return it."""
    own, simulator = stance(), SimulatorParameters()
    body, inertia = own.tipping('behind')
    on_pads = conditions(durations=DURATIONS[:1], gyros=('packaged',), changes=PADS)
    return page_text(
        __name__,
        body=body,
        heels=own.tipping('front')[0].half_foot,
        inertia=inertia / (body.mass * (body.length**2 + body.half_foot**2)),
        servo=legs(own, simulator),
        pad_distance=simulator.pad_distance,
        start=START,
        watch=WATCH,
        tolerance=TOLERANCE,
        pushes=largest_pushes(measure_all(conditions())),
        on_pads=largest_pushes(measure_all(on_pads)),
        momentum=_table([momentum(duration) for duration in SHORT]),
        compliance=_table([compliance(duration) for duration in DURATIONS]),
    ).strip()


def write(rows: Sequence[PushRow], out: Path) -> list[Path]:
    """Write push.csv and push.md into a folder; return their paths."""
    texts = {
        out / 'push.csv': csv_of(rows),
        out / 'push.md': markdown([largest_pushes(rows)]) + '\n',
    }
    for path, text in texts.items():
        write_text(path, text)
    return list(texts)


PART = WrittenPart('khr_studies.push.page docs/models.md', document_part)

if __name__ == '__main__':
    # by the module's own name, at which its template is
    from khr_studies.push import page

    page.PART.main()
