"""The thesis's figures, drawn from its models or from runs: ``draw('3.8', out)``.

A figure is a function that returns a matplotlib Figure; a figure of experiments receives their
runs. Its CSV has one row per point of every labelled line, with the panel and the axes' labels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from khr_common import KhrError
from khr_experiments.experiments import Runs
from khr_report.figures import (
    balance,
    gaits,
    gyro,
    lines,
    push_robot,
    pushes,
    spectra,
    stages,
    standing,
    walking,
)
from khr_report.figures.points import write_points
from khr_report.plot_style import styled


@dataclass(frozen=True)
class Drawing:
    """How a figure is drawn.

    Attributes:
        title: what it shows, in one line.
        draw: returns it; receives a mapping of experiments to their runs if it needs any.
        experiments: names of those that it is drawn from; none for a figure of the models.
        quick: draws a coarse form in seconds where ``draw`` takes minutes.
    """

    title: str
    draw: Callable[..., Figure]
    experiments: tuple[str, ...] = ()
    quick: Callable[..., Figure] | None = None


FIGURES: dict[str, Drawing] = {
    '3.4': Drawing(
        'Toe and heel force of the support foot while the other leg lifts and comes down',
        standing.forces_over_time,
        ('lift_inclination',),
    ),
    '3.5': Drawing(
        'Toe and heel force over the inclination, standing on each leg',
        standing.toe_and_heel,
        ('lift_inclination',),
    ),
    '3.6': Drawing(
        'Delta over the inclination in the three stages of control, beside (3.7)',
        standing.stages,
        standing.EXPERIMENTS,
    ),
    '3.8': Drawing(
        'The lean over time of (3.6), without a foot, for several inclinations', balance.swing
    ),
    '3.9': Drawing(
        'Phi_cr over the initial lean: (3.10), exact, and by the tangent',
        balance.critical_inclination,
    ),
    '3.10': Drawing(
        'Delta over phi: theory (3.7), the settled simulation of (3.11), and the robot',
        balance.force_difference,
        ('lift_inclination',),
    ),
    '3.11b': Drawing(
        "The servo's output over its error, swept slowly to and fro at each reference",
        balance.servo_characteristic,
    ),
    '3.12': Drawing(
        "The step of (3.11) and its rate, and the robot's rate while its motors adjust",
        balance.servo_step,
        ('lift_stages',),
    ),
    '3.13': Drawing(
        'The largest overshoot of the pitch rate over phi: in that step, and of the robot',
        balance.largest_overshoot,
        standing.EXPERIMENTS,
    ),
    '3.15': Drawing(
        'Delta over the inclination for raised gains of the ankle loop',
        standing.gains,
        (*standing.EXPERIMENTS, 'lift_gains'),
    ),
    '4.4': Drawing('V_out, the carrier modulated by the rate', gyro.modulated),
    '4.5': Drawing('The demodulated output beside the rate', gyro.demodulated),
    '4.6': Drawing('The settled output over the rate', gyro.static_characteristic),
    '4.8': Drawing(
        'The pitch rate over time for rising forces, without control, of models and robot',
        pushes.rising_force,
    ),
    '4.10': Drawing(
        'X_COM over time with and without control, against the band (4.7)', pushes.recovery
    ),
    '4.11': Drawing(
        'X_COM over time with and without control, of the robot beside the model of its body',
        push_robot.with_and_without_control,
    ),
    '4.12': Drawing(
        'X_COM over time for pushes from both sides: model on flat and incline, and robot',
        pushes.both_directions,
    ),
    '5.5': Drawing(
        'The pitch rate of a whole walk on the flat, and of its third cycle, Gait-3',
        gaits.whole_walk,
        gaits.EXPERIMENTS,
    ),
    '5.6': Drawing(
        'Gait-3 without control on ground ever steeper', gaits.without_control, gaits.EXPERIMENTS
    ),
    '5.7': Drawing(
        'Gait-3 with ankle control, and with ankle and hip control, ever steeper',
        gaits.with_control,
        gaits.EXPERIMENTS,
    ),
    '5.8': Drawing(
        'The amplitude spectra of Gait-3 without control, downhill ever steeper',
        spectra.without_control,
        gaits.EXPERIMENTS,
    ),
    '5.9': Drawing(
        'The amplitude spectra of Gait-3 with control, downhill ever steeper',
        spectra.with_control,
        gaits.EXPERIMENTS,
    ),
    '5.10': Drawing(
        'The phase of the lines of Gait-3 that reach a third of the largest',
        spectra.phases,
        gaits.EXPERIMENTS,
    ),
    '5.11': Drawing(
        'The dominant frequencies over the inclination: theory, thesis and simulated robot',
        walking.dominant_frequencies,
        gaits.EXPERIMENTS,
    ),
    '5.12': Drawing(
        "The spectra of Gait-3 over the ankle's and the hip's gain", spectra.gains, spectra.GAINS
    ),
    '5.13': Drawing(
        'Walks with ankle control on smooth ground beside those on rubber soles',
        spectra.ankle_on_soles,
        ('walk_soles',),
    ),
    '5.14': Drawing(
        'Walks with ankle and hip control on smooth ground beside those on rubber soles',
        spectra.ankle_and_hip_on_soles,
        ('walk_soles',),
    ),
    'friction': Drawing(
        'Up to which inclination the robot stands, over the friction', balance.friction
    ),
    'harmonics': Drawing(
        'How the harmonics that gravity makes grow with the inclination', walking.harmonics
    ),
    'lines': Drawing(
        'The spectra of walks that tell lines of the gait from what control adds',
        lines.origin_of_lines,
        ('lines',),
    ),
    'push': Drawing(
        'The largest push survived over the gain, for both forms, durations and directions',
        pushes.largest,
    ),
    'push_robot': Drawing(
        'The largest impulse over the gain, and x_COM of pushes about the largest one',
        push_robot.side_by_side,
        quick=push_robot.for_one_duration,
    ),
    'stages': Drawing(
        'The robot climbing through the stages of control as its ground tilts',
        stages.climb,
        ('stages',),
    ),
    'stiffness': Drawing(
        "How the joint's stiffness acts on the loop's vibration", walking.stiffness
    ),
}


class FigureError(KhrError):
    """A figure cannot be drawn."""


def drawing_of(number: str) -> Drawing:
    """Return how a figure is drawn.

    Raises:
        FigureError: if there is no such figure.
    """
    if number not in FIGURES:
        raise FigureError(f'figure: {number!r} is not known; accepted: {", ".join(FIGURES)}')
    return FIGURES[number]


def paths(number: str, out: Path) -> tuple[Path, Path]:
    """Return the paths of a figure's PNG and CSV in a folder."""
    name = f'figure_{number.replace(".", "_")}'
    return out / f'{name}.png', out / f'{name}.csv'


def draw(
    number: str, out: Path, runs: dict[str, Runs] | None = None, fast: bool = False
) -> list[Path]:
    """Draw a figure and write it as PNG and CSV.

    Args:
        number: the thesis's number of the figure, or the name of one that the thesis lacks.
        out: the folder to write into; made if needed.
        runs: of the figure's experiments, by name; None for a figure of the models.
        fast: whether to draw the coarse form, if there is one.

    Returns:
        The paths of the PNG and the CSV.

    Raises:
        FigureError: if there is no such figure, or the folder cannot be written.
    """
    drawing = drawing_of(number)
    image, points = paths(number, out)
    with styled():
        function = drawing.quick if fast and drawing.quick else drawing.draw
        figure = function(runs) if drawing.experiments else function()
        try:
            out.mkdir(parents=True, exist_ok=True)
            figure.savefig(image, metadata={'Software': None})
            write_points(figure, points)
        except OSError as failure:
            raise FigureError(
                f'out: {str(out)!r} cannot be written ({failure.strerror}); '
                'accepted: a directory that can'
            ) from failure
    return [image, points]
