"""The thesis's figures, drawn from its models or from runs: ``draw('3.8', out)``.

A figure is a function that returns a matplotlib Figure; a figure of experiments receives their
runs. Its CSV has one row per point of every labelled line, with the panel and the axes' labels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from khr_common.files import written
from khr_report.folders import make_folder
from khr_report.plots.plot_style import head, save, styled
from khr_report.plots.points import write_points
from khr_sim.physics import engines
from khr_studies.errors import StudyError
from khr_studies.measuring import experiments
from khr_studies.measuring.experiments import Runs
from khr_studies.peak_origin import figure as lines
from khr_studies.peak_origin.odd_line import odd_lines
from khr_studies.peak_origin.study import explain_all
from khr_studies.push import figure as pushes
from khr_studies.push import largest, largest_figure, motions
from khr_studies.thesis_figures import (
    gaits,
    gyro,
    spectra,
    spectra_compared,
    stages,
    standing,
    walking,
)
from khr_studies.thesis_figures import pendulum_figures as balance
from khr_studies.thesis_figures.records import RATES
from khr_sweeps.pool import check_workers


@dataclass(frozen=True)
class Drawing:
    """How a figure is drawn.

    Attributes:
        title: what it shows, in one line.
        figure: returns it, from a mapping of experiments to their runs, or from what ``measure``
            returned; a figure of the models needs neither. One that shows a pitch rate of runs
            takes as ``rate`` which one, by default the gyro's, as in the thesis, or the true one
            where the gyro's steps hide what is shown.
        experiments: names of those that it is drawn from.
        measure: finds what it shows, if that is more than the runs: of these, if it is drawn from
            experiments, and on an ``engine`` if it takes one.
        quick: the same coarsely, in seconds where ``measure`` takes minutes.
    """

    title: str
    figure: Callable[..., Figure]
    experiments: tuple[str, ...] = ()
    measure: Callable[..., Any] | None = None
    quick: Callable[..., Any] | None = None

    @property
    def of_robot(self) -> bool:
        """Return whether it shows the simulated robot, and depends on the physics engine."""
        return bool(self.experiments) or _takes(self.measure, 'engine')

    @property
    def rate(self) -> bool:
        """Return whether it shows a pitch rate of runs, and another may be asked for."""
        return _takes(self.figure, 'rate')

    def draw(self, *of_runs: Any, engine: str = engines.DEFAULT, fast: bool = False) -> Figure:
        """Measure what it shows, if that is to be measured, then draw it.

        Args:
            of_runs: the runs of its experiments, and a pitch rate of RATES if it shows one.
            engine: physics engine of what is measured.
            fast: whether to measure coarsely, if that can be.
        """
        measure = (fast and self.quick) or self.measure
        if measure is None:
            return self.figure(*of_runs)
        on_engine = {'engine': engine} if _takes(measure, 'engine') else {}
        return self.figure(measure(*of_runs, **on_engine))


def _takes(function: Callable[..., Any] | None, name: str) -> bool:
    return function is not None and name in signature(function).parameters


LIFTS = ('lift_inclination',)
ALL = 'all'
FIGURES: dict[str, Drawing] = {
    '3.4': Drawing('Toe and heel force of the support foot', standing.forces_over_time, LIFTS),
    '3.5': Drawing('Toe and heel force against the inclination', standing.toe_and_heel, LIFTS),
    '3.6': Drawing(
        'Delta against the inclination, by stage of control', standing.stages, standing.EXPERIMENTS
    ),
    '3.8': Drawing('Lean of the bare pendulum (3.6)', balance.swing),
    '3.9': Drawing('Critical inclination against the lean', balance.critical_inclination),
    '3.10': Drawing(
        'Delta against the inclination: (3.7), (3.11) and the robot',
        balance.force_difference,
        LIFTS,
    ),
    '3.11b': Drawing('Output of the servo against its error', balance.servo_characteristic),
    '3.12': Drawing('Step response of the servo (3.11)', balance.servo_step, ('lift_stages',)),
    '3.13': Drawing(
        'Largest pitch rate against the inclination',
        balance.largest_overshoot,
        standing.EXPERIMENTS,
    ),
    '3.15': Drawing(
        'Delta against the inclination, by ankle gain',
        standing.gains,
        (*standing.EXPERIMENTS, 'lift_gains'),
    ),
    '4.4': Drawing('V_out of the gyro: the carrier modulated by the rate', gyro.modulated),
    '4.5': Drawing('Demodulated output of the gyro', gyro.demodulated),
    '4.6': Drawing('Static characteristic of the gyro', gyro.static_characteristic),
    '4.8': Drawing(
        'Pitch rate under a lasting push, without control',
        pushes.rising_force,
        measure=motions.rising_force,
    ),
    '4.10': Drawing(
        'Recovery from a push, with and without control', pushes.recovery, measure=motions.recovery
    ),
    '4.11': Drawing(
        'Recovery of robot and model, with and without control',
        pushes.with_and_without_control,
        measure=motions.with_and_without_control,
    ),
    '4.12': Drawing(
        'Pushes from behind and from the front',
        pushes.both_directions,
        measure=motions.both_directions,
    ),
    '5.5': Drawing('Pitch rate of a whole walk', gaits.whole_walk, gaits.FINGERPRINT),
    '5.6': Drawing(
        'Gait-3 without control, and with ankle control',
        gaits.without_and_with_ankle,
        gaits.EXPERIMENTS,
    ),
    '5.7': Drawing(
        'Gait-3 with ankle and hip control', gaits.with_ankle_and_hip, gaits.EXPERIMENTS
    ),
    '5.8': Drawing(
        'Spectra without control, and with ankle control',
        spectra.without_and_with_ankle,
        gaits.EXPERIMENTS,
    ),
    '5.9': Drawing(
        'Spectra with ankle and hip control', spectra.with_ankle_and_hip, gaits.EXPERIMENTS
    ),
    '5.10': Drawing('Phase of the large lines of Gait-3', spectra.phases, gaits.EXPERIMENTS),
    '5.11': Drawing(
        'Dominant frequencies against the inclination',
        walking.dominant_frequencies,
        gaits.EXPERIMENTS,
    ),
    '5.12': Drawing(
        'Spectra by ankle and hip gain', spectra_compared.gains, spectra_compared.GAINS
    ),
    '5.13': Drawing(
        'Smooth and rubber soles, ankle control', spectra_compared.ankle_on_soles, ('walk_soles',)
    ),
    '5.14': Drawing(
        'Smooth and rubber soles, ankle and hip control',
        spectra_compared.ankle_and_hip_on_soles,
        ('walk_soles',),
    ),
    'friction': Drawing('Largest inclination against the friction', balance.friction),
    'harmonics': Drawing('Harmonics from gravity against the inclination', walking.harmonics),
    'line_11': Drawing(
        'What raises line 11 of the gait, 4.74 Hz', lines.line_11, ('line_11',), measure=odd_lines
    ),
    'lines': Drawing(
        'Origin of the spectral lines', lines.origin_of_lines, ('lines',), measure=explain_all
    ),
    'push': Drawing(
        'Largest push against the gain, models',
        largest_figure.largest_of_thesis,
        measure=largest.largest_of_thesis,
    ),
    'push_robot': Drawing(
        'Largest push against the gain, robot and models',
        largest_figure.largest_pushes,
        measure=largest.largest_pushes,
        quick=largest.coarse_pushes,
    ),
    'stages': Drawing('Staged control on tilting ground', stages.climb, ('stages',)),
    'stiffness': Drawing("Vibration against the joint's stiffness", walking.stiffness),
}


def drawing_of(number: str) -> Drawing:
    """Return how a figure is drawn.

    Raises:
        StudyError: if there is no such figure.
    """
    if number not in FIGURES:
        raise StudyError(f'figure: {number!r} is not known; accepted: {ALL}, {", ".join(FIGURES)}')
    return FIGURES[number]


def numbers_of(asked: Sequence[str]) -> list[str]:
    """Return the figures that are asked for, each once.

    Args:
        asked: numbers; ``all`` is all figures, and a number such as 3.11 also those with a letter.

    Raises:
        StudyError: if there is no such figure.
    """
    found: dict[str, None] = {}
    for number in asked:
        parts = [each for each in FIGURES if each[:-1] == number and each[-1].isalpha()]
        chosen = list(FIGURES) if number == ALL else [number] if number in FIGURES else parts
        if not chosen:
            drawing_of(number)  # which says what is known
        found.update(dict.fromkeys(chosen))
    return list(found)


def paths(number: str, out: Path, engine: str = engines.DEFAULT) -> tuple[Path, Path]:
    """Return the paths of a figure's PNG and CSV in a folder; another engine is in their names."""
    name = f'figure_{number.replace(".", "_")}{suffix(number, engine)}'
    return out / f'{name}.png', out / f'{name}.csv'


def draw(
    number: str,
    out: Path,
    runs: dict[str, Runs] | None = None,
    fast: bool = False,
    signal: str | None = None,
    engine: str = engines.DEFAULT,
) -> list[Path]:
    """Draw a figure and write it as PNG and CSV.

    Args:
        number: the thesis's number of the figure, or the name of one that the thesis lacks.
        out: the folder to write into; made if needed.
        runs: by experiment, with those of the figure; None for a figure of the models.
        fast: whether to draw the coarse form, if there is one.
        signal: the pitch rate to show of runs, one of RATES; by default the drawing's own.
        engine: physics engine of the runs, and of what is run for the drawing.

    Returns:
        The paths of the PNG and the CSV.

    Raises:
        StudyError: if there is no such figure or signal, or the folder cannot be written.
    """
    drawing = drawing_of(number)
    if signal is not None and signal not in RATES:
        raise StudyError(f'signal: {signal!r} is not known; accepted: {", ".join(RATES)}')
    make_folder(out)
    image, points = paths(number, out, engine)
    with styled():
        needed = {name: (runs or {})[name] for name in drawing.experiments}
        rate = [RATES[signal]] if signal and drawing.rate else []
        figure = drawing.draw(*([needed] if needed else []), *rate, engine=engine, fast=fast)
        if suffix(number, engine):
            head(figure, f'{figure.get_suptitle()}; on {engine}')
        write_points(figure, points)
        with written(image) as part:
            save(figure, part)
    return [image, points]


def suffix(number: str, engine: str) -> str:
    """Return what the files of a figure have in their names on another engine than the default."""
    return f'_{engine}' if engine != engines.DEFAULT and drawing_of(number).of_robot else ''


def run_experiments(
    numbers: Iterable[str], fast: bool = False, engine: str = engines.DEFAULT
) -> dict[str, Runs]:
    """Return the runs that figures are drawn from, by experiment; those missing are run first.

    Raises:
        StudyError: if there is no such figure or engine.
        RunError: if the computation could not go on; what is finished is kept.
    """
    if engine not in engines.LIBRARIES:
        accepted = ' | '.join(engines.LIBRARIES)
        raise StudyError(f'--engine: {engine!r} is not accepted; accepted: {accepted}')
    needed = {name: None for number in numbers for name in drawing_of(number).experiments}
    experiments.run_sweeps(experiments.sweeps_of([*needed], fast, engine), check_workers(None))
    return experiments.runs_by_name(needed, experiments.root_of(engine), fast)
