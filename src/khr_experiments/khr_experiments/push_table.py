"""The largest pushes of robot and model side by side, as CSV and Markdown.

``python -m khr_experiments.push_table docs/models.md`` writes them into the models' document; it
takes a few minutes.
"""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryFile

from khr_analysis.models.ankle_servo import Pid
from khr_analysis.models.push import DIRECTIONS, capture_force
from khr_analysis.models.push import largest_push as largest_of_model
from khr_common.files import write_text
from khr_common.markdown import put_between, rewrite_document, table
from khr_experiments.errors import ExperimentError
from khr_experiments.push_model import legs, model_loop, model_push
from khr_experiments.push_recovery import (
    GYROS,
    START,
    TOLERANCE,
    WATCH,
    Changes,
    PushCondition,
    largest_push,
    push_robot,
    stance,
)
from khr_sim.parameters import SimulatorParameters

GAINS = (0.0, 12.0, 18.0)
DURATIONS = (0.1, 0.2, 0.5)  # s
SHORT = (0.02, 0.05, *DURATIONS)  # s, of the momentum argument
SAME = 0.6  # N s, the impulse compared over durations
BEGIN = '<!-- begin: written by python -m khr_experiments.push_table docs/models.md -->'
END = '<!-- end of the robot -->'
# Servos four times as stiff; still stiffer ones rattle after the push.
STIFF: Changes = ((('simulator', 'stiffness_per_stretch'), 1.0),)
STIFFER = 20.0  # times, of the model's servo
PADS: Changes = ((('simulator', 'surface'), 'pads'),)


@dataclass(frozen=True)
class PushRow:
    """One condition; forces in N, durations in s.

    The robot survives ``survived`` and falls at ``fatal``. The models' forces are the largest
    that they survive: with this robot's body or the thesis's, physical or as published.
    """

    direction: str
    duration: float
    gain: float
    gyro: str
    survived: float
    fatal: float
    physical_robot: float
    published_robot: float
    physical_thesis: float
    published_thesis: float


def conditions(
    gains: Sequence[float] = GAINS,
    durations: Sequence[float] = DURATIONS,
    directions: Sequence[str] = DIRECTIONS,
    gyros: Sequence[str] = tuple(GYROS),
    changes: Changes = (),
) -> list[PushCondition]:
    """Return all combinations; without control the gyro does not matter, and the first serves.

    Raises:
        ExperimentError: if a value is not accepted.
    """
    return [
        PushCondition(gain, duration, direction, gyro, changes)  # type: ignore[arg-type]
        for direction, duration, gyro, gain in product(directions, durations, gyros, gains)
        if gain or gyro == gyros[0]
    ]


def measure(condition: PushCondition) -> PushRow:
    """Measure one condition on robot and models."""
    robot = largest_push(condition)
    return PushRow(
        condition.direction,
        condition.duration,
        condition.gain,
        condition.gyro,
        robot.survived,
        robot.fatal,
        *(
            model_push(condition, form, body)
            for body in ('robot', 'thesis')
            for form in ('physical', 'published')
        ),
    )


def measure_all(tried: Iterable[PushCondition]) -> list[PushRow]:
    """Measure conditions, telling each on stderr."""
    rows = []
    for condition in tried:
        row = measure(condition)
        print(
            f'{row.direction:6} {row.duration:g} s  K_A {row.gain:<4g}{row.gyro:9} '
            f'robot {row.survived:.2f} to {row.fatal:.2f} N, model {row.physical_robot:.2f} N',
            file=sys.stderr,
            flush=True,
        )
        rows.append(row)
    return rows


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


def markdown(rows: Sequence[PushRow]) -> str:
    """Return rows as a Markdown table: a line per duration and body, a column per loop."""
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
    return table(['push', 'who', *head], lines)


def momentum() -> str:
    """Return, per duration, the robot's largest impulse beside the closed forms, as Markdown."""
    (own, inertia), lines = stance().tipping('behind'), []
    for duration in SHORT:
        condition = PushCondition(duration=duration)
        found = largest_push(condition)
        motion = push_robot(condition, SAME / duration)
        after = (
            'falls' if motion.fell else f'{1e3 * (motion.x_com.max() - motion.x_com[0]):.1f} mm'
        )
        lines.append(
            [
                f'{duration:g}',
                f'{duration * found.survived:.3f} to {duration * found.fatal:.3f}',
                *(
                    f'{duration * capture_force(own, each, duration):.3f}'
                    for each in (own.inertia, inertia)
                ),
                after,
            ]
        )
    return table(
        [
            'push, s',
            'robot, N s',
            'point mass, N s',
            'rigid body, N s',
            f'COM carried by {SAME:g} N s',
        ],
        lines,
    )


def compliance() -> str:
    """Return what stiff servos do to the largest push of robot and model, as Markdown."""
    lines = []
    for duration in DURATIONS:
        soft, hard = (PushCondition(duration=duration, changes=changes) for changes in ((), STIFF))
        edge, inertia = stance(hard.base()).tipping('behind')
        loop = model_loop(soft, 'physical', 'robot')
        pid = Pid(STIFFER * loop.pid.proportional, 0.0, STIFFER * loop.pid.derivative)
        lines.append(
            [
                f'{duration:g}',
                *(
                    f'{force:.2f}'
                    for force in (
                        largest_push(soft).middle,
                        largest_push(hard).middle,
                        capture_force(edge, inertia, duration),
                        model_push(soft, 'physical', 'robot'),
                        largest_of_model(replace(loop, pid=pid), duration=duration, watch=WATCH),
                        capture_force(edge, edge.inertia, duration),
                    )
                ),
            ]
        )
    return table(
        [
            'push, s',
            'robot, N',
            'with stiff servos, N',
            'rigid, closed form, N',
            'model of its body, N',
            'with a stiff servo, N',
            'rigid point mass, closed form, N',
        ],
        lines,
    )


def document_part() -> str:
    """Return what the models' document says of the robot."""
    own = stance()
    pid = legs(own, SimulatorParameters())
    body, inertia = own.tipping('behind')
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
            markdown(measure_all(conditions())),
            f'On the force-sensor pads, {2e3 * SimulatorParameters().pad_distance:.0f} mm from heel '
            'to toe, near the b/l of the thesis:',
            markdown(
                measure_all(conditions(durations=DURATIONS[:1], gyros=('packaged',), changes=PADS))
            ),
            'The momentum argument, without control, from behind:',
            momentum(),
            'Compliance, without control, from behind:',
            compliance(),
        ]
    )


def rewrite(text: str) -> str:
    """Replace what stands between the markers.

    Raises:
        KhrError: if a marker is missing.
    """
    return put_between(text, BEGIN, END, document_part())


def make_folder(out: Path) -> None:
    """Make a folder to write into; called before minutes of measuring, not after.

    Raises:
        ExperimentError: if it cannot be made or written.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            pass
    except OSError as failure:
        raise ExperimentError(
            f'--out: {str(out)!r} cannot be written ({failure.strerror}); '
            'accepted: a directory that can'
        ) from failure


def write(rows: Sequence[PushRow], out: Path) -> list[Path]:
    """Write push.csv and push.md into a folder; return their paths."""
    texts = {out / 'push.csv': csv_of(rows), out / 'push.md': markdown(rows) + '\n'}
    for path, text in texts.items():
        write_text(path, text)
    return list(texts)


def numbers(name: str, text: str) -> list[float]:
    """Read a list such as 0,12,18.

    Raises:
        ExperimentError: if it is none.
    """
    try:
        return [float(word) for word in text.split(',')]
    except ValueError:
        raise ExperimentError(
            f'{name}: {text!r} is not accepted; accepted: numbers, separated by commas'
        ) from None


def main() -> None:
    """Rewrite the document named on the command line."""
    rewrite_document(rewrite)


if __name__ == '__main__':
    main()
