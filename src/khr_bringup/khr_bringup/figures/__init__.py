"""The thesis's theoretical figures, each drawn from the models: ``draw('3.8', out)``.

A figure is a function that returns a matplotlib Figure. What it draws is also what its CSV holds:
one row per point of every labelled line, with the panel and the axes' labels.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib
import matplotlib.style
from matplotlib.figure import Figure

from khr_bringup.figures import balance, gyro, push_robot, pushes, walking
from khr_bringup.figures.table import write_table
from khr_common.errors import KhrError

STYLE = Path(__file__).with_name('khr.mplstyle')
FIGURES: dict[str, Callable[[], Figure]] = {
    '3.8': balance.swing,
    '3.9': balance.critical_inclination,
    '3.10': balance.force_difference,
    '3.11b': balance.servo_characteristic,
    '3.12': balance.servo_step,
    '3.13': balance.largest_overshoot,
    '4.4': gyro.modulated,
    '4.5': gyro.demodulated,
    '4.6': gyro.static_characteristic,
    '4.8': pushes.rising_force,
    '4.10': pushes.recovery,
    '4.12': pushes.both_directions,
    '5.11': walking.dominant_frequencies,
    'friction': balance.friction,
    'harmonics': walking.harmonics,
    'push': pushes.largest,
    'push_robot': push_robot.side_by_side,
    'stiffness': walking.stiffness,
}


class FigureError(KhrError):
    """A figure cannot be drawn."""


def draw(number: str, out: Path) -> list[Path]:
    """Draw a figure and write it as PNG and CSV.

    Args:
        number: the thesis's number of the figure, or the name of one that the thesis lacks.
        out: the directory to write into; made if it is not there.

    Returns:
        The paths of the PNG and the CSV.

    Raises:
        FigureError: if there is no such figure (the message lists those there are), or the
            directory cannot be written.
    """
    if number not in FIGURES:
        raise FigureError(f'figure: {number!r} is not known; accepted: {", ".join(FIGURES)}')
    name = f'figure_{number.replace(".", "_")}'
    image, table = out / f'{name}.png', out / f'{name}.csv'
    with matplotlib.rc_context(), matplotlib.style.context(STYLE):
        figure = FIGURES[number]()
        try:
            out.mkdir(parents=True, exist_ok=True)
            figure.savefig(image, metadata={'Software': None})
            write_table(figure, table)
        except OSError as failure:
            raise FigureError(f'out: {str(out)!r} cannot be written ({failure.strerror}); '
                              'accepted: a directory that can') from failure
    return [image, table]
