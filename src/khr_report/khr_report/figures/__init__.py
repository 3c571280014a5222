"""The thesis's figures, drawn from its models or from runs: ``draw('3.8', out)``.

A figure is a function that returns a matplotlib Figure; one of experiments takes their runs. What
it draws is also what its CSV holds: one row per point of every labelled line, with the panel and
the axes' labels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from khr_common import KhrError
from khr_common.files import written
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
from khr_report.figures.table import write_table
from khr_report.plot_style import styled


@dataclass(frozen=True)
class Drawing:
    """How a figure comes about.

    Attributes:
        draw: returns it; from nothing, or from a mapping of experiments to their runs. The first
            line of its docstring, ``Draw ...``, is the figure's title.
        experiments: names of those that it is drawn from; none for a figure of the models.
        quick: draws it coarsely and takes seconds, where ``draw`` takes minutes.
    """

    draw: Callable[..., Figure]
    experiments: tuple[str, ...] = ()
    quick: Callable[..., Figure] | None = None

    @property
    def title(self) -> str:
        """Tell what the figure shows, in one line."""
        text = (self.draw.__doc__ or '').splitlines()[0].removeprefix('Draw ').rstrip('.')
        return text[:1].upper() + text[1:]


FIGURES: dict[str, Drawing] = {
    '3.4': Drawing(standing.forces_over_time, ('lift_inclination',)),
    '3.5': Drawing(standing.toe_and_heel, ('lift_inclination',)),
    '3.6': Drawing(standing.stages, standing.EXPERIMENTS),
    '3.8': Drawing(balance.swing),
    '3.9': Drawing(balance.critical_inclination),
    '3.10': Drawing(balance.force_difference, ('lift_inclination',)),
    '3.11b': Drawing(balance.servo_characteristic),
    '3.12': Drawing(balance.servo_step, ('lift_stages',)),
    '3.13': Drawing(balance.largest_overshoot, standing.EXPERIMENTS),
    '3.15': Drawing(standing.gains, (*standing.EXPERIMENTS, 'lift_gains')),
    '4.4': Drawing(gyro.modulated),
    '4.5': Drawing(gyro.demodulated),
    '4.6': Drawing(gyro.static_characteristic),
    '4.8': Drawing(pushes.rising_force),
    '4.10': Drawing(pushes.recovery),
    '4.11': Drawing(push_robot.with_and_without_control),
    '4.12': Drawing(pushes.both_directions),
    '5.5': Drawing(gaits.whole_walk, gaits.EXPERIMENTS),
    '5.6': Drawing(gaits.without_control, gaits.EXPERIMENTS),
    '5.7': Drawing(gaits.with_control, gaits.EXPERIMENTS),
    '5.8': Drawing(spectra.without_control, gaits.EXPERIMENTS),
    '5.9': Drawing(spectra.with_control, gaits.EXPERIMENTS),
    '5.10': Drawing(spectra.phases, gaits.EXPERIMENTS),
    '5.11': Drawing(walking.dominant_frequencies, gaits.EXPERIMENTS),
    '5.12': Drawing(spectra.gains, spectra.GAINS),
    '5.13': Drawing(spectra.ankle_on_soles, ('walk_soles',)),
    '5.14': Drawing(spectra.ankle_and_hip_on_soles, ('walk_soles',)),
    'friction': Drawing(balance.friction),
    'harmonics': Drawing(walking.harmonics),
    'lines': Drawing(lines.origin_of_lines, ('lines',)),
    'push': Drawing(pushes.largest),
    'push_robot': Drawing(push_robot.side_by_side, quick=push_robot.for_one_duration),
    'stages': Drawing(stages.climb, ('stages',)),
    'stiffness': Drawing(walking.stiffness),
}


class FigureError(KhrError):
    """A figure cannot be drawn."""


def drawing_of(number: str) -> Drawing:
    """Return how a figure is drawn.

    Raises:
        FigureError: if there is no such figure; the text lists those there are.
    """
    if number not in FIGURES:
        raise FigureError(f'figure: {number!r} is not known; accepted: {", ".join(FIGURES)}')
    return FIGURES[number]


def paths(number: str, out: Path) -> tuple[Path, Path]:
    """Return the paths of a figure's PNG and CSV in a directory."""
    name = f'figure_{number.replace(".", "_")}'
    return out / f'{name}.png', out / f'{name}.csv'


def draw(
    number: str, out: Path, runs: dict[str, Runs] | None = None, fast: bool = False
) -> list[Path]:
    """Draw a figure and write it as PNG and CSV.

    Args:
        number: the thesis's number of the figure, or the name of one that the thesis lacks.
        out: the directory to write into; made if it is not there.
        runs: of the figure's experiments, by name; nothing for a figure of the models.
        fast: whether to draw it coarsely, if it takes minutes otherwise.

    Returns:
        The paths of the PNG and the CSV.

    Raises:
        FigureError: if there is no such figure (the message lists those there are), or the
            directory cannot be written.
    """
    drawing = drawing_of(number)
    image, table = paths(number, out)
    with styled():
        function = drawing.quick if fast and drawing.quick else drawing.draw
        figure = function(runs) if drawing.experiments else function()
        try:
            out.mkdir(parents=True, exist_ok=True)
            with written(image) as part:
                figure.savefig(part, metadata={'Software': None})
            with written(table) as part:
                write_table(figure, part)
        except OSError as failure:
            raise FigureError(
                f'out: {str(out)!r} cannot be written ({failure.strerror}); '
                'accepted: a directory that can'
            ) from failure
    return [image, table]
