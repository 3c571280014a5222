"""The figures of the thesis, drawn from its models or from runs: ``draw('3.8', out)``.

A function draws each figure and returns a matplotlib Figure; a figure of experiments receives
their runs. Its CSV has a row per point of every labelled line, with panel and axis labels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from khr_bringup.scenario.robots import constants_of, label_of
from khr_common.checks import one_of
from khr_common.errors import KhrError, quoted
from khr_common.files import written
from khr_report.output import make_folder
from khr_report.plots.plot_style import (
    PICTURES,
    VECTOR,
    head,
    remove_heading,
    save,
    set_columns,
    styled,
    write_points,
)
from khr_sim.physics import engines
from khr_studies.measuring import experiments
from khr_studies.measuring.experiments import Runs
from khr_studies.peak_origin import figure as lines
from khr_studies.peak_origin.study import explain_all, measure_line_11
from khr_studies.push import figure as pushes
from khr_studies.push import limits, motions
from khr_studies.thesis_figures import gaits, models, spectra, standing, vibration
from khr_studies.thesis_figures import pendulum_figures as balance
from khr_studies.thesis_figures.run_plots import RATES
from khr_sweeps.pool import check_workers


@dataclass(frozen=True)
class Drawing:
    """How a figure is drawn."""

    title: str  # one line
    # returns the figure, from the runs by experiment or from the result of measure; a figure of
    # the models takes neither. If it takes rate, it shows a pitch rate of runs: by default the
    # gyro's, as in the thesis, or the true rate where the gyro's steps would hide the curve.
    figure: Callable[..., Figure]
    experiments: tuple[str, ...] = ()  # names of the experiments of its runs
    # measures further data, from the runs if there are experiments, and on an engine if it takes
    # one
    measure: Callable[..., Any] | None = None
    # a coarse form of measure, in seconds instead of minutes
    quick: Callable[..., Any] | None = None

    @property
    def of_robot(self) -> bool:
        """Return True if it shows the simulated robot, and so depends on the physics engine."""
        return bool(self.experiments) or _takes(self.measure, 'engine')

    @property
    def rate(self) -> bool:
        """Return True if it shows a pitch rate of runs that can be chosen."""
        return _takes(self.figure, 'rate')

    def check_robot(self, robot: str) -> None:
        """Check that it can show another robot.

        Raises:
            KhrError: if it measures the default robot only.
        """
        if robot and _takes(self.measure, 'engine') and not _takes(self.measure, 'robot'):
            raise KhrError(
                f'--robot: {quoted(robot)} is not accepted for "{self.title}"; accepted: figures of '
                'leg lifts and walks, not of pushes'
            )

    def draw(
        self, *of_runs: Any, engine: str = engines.DEFAULT, fast: bool = False, robot: str = ''
    ) -> Figure:
        """Measure the data if needed, then draw the figure.

        Args:
            of_runs: the runs of its experiments, and one of RATES if it shows a pitch rate.
            engine: physics engine of the measurement.
            fast: whether to measure coarsely if possible.
            robot: constants of another robot for the measurement, by name or file.
        """
        measure = (fast and self.quick) or self.measure
        if measure is None:
            return self.figure(*of_runs)
        given = {'engine': engine, 'robot': robot}
        taken = {name: value for name, value in given.items() if _takes(measure, name)}
        return self.figure(measure(*of_runs, **taken))


def _takes(function: Callable[..., Any] | None, name: str) -> bool:
    return function is not None and name in signature(function).parameters


LIFTS, SOLES = ('lift_inclination',), ('walk_soles',)
STANDING, WALKS = standing.EXPERIMENTS, gaits.EXPERIMENTS
ALL = 'all'
FIGURES: dict[str, Drawing] = {
    '3.4': Drawing('Toe and heel force of the support foot', standing.forces_over_time, LIFTS),
    '3.5': Drawing('Toe and heel force against the inclination', standing.toe_and_heel, LIFTS),
    '3.6': Drawing(
        'Delta against the inclination, by stage of control', standing.stages, STANDING
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
        'Largest pitch rate against the inclination', balance.largest_overshoot, STANDING
    ),
    '3.15': Drawing(
        'Delta against the inclination, by ankle gain', standing.gains, (*STANDING, 'lift_gains')
    ),
    '4.4': Drawing('V_out of the gyro: the carrier modulated by the rate', models.modulated),
    '4.5': Drawing('Demodulated output of the gyro', models.demodulated),
    '4.6': Drawing('Static characteristic of the gyro', models.static_characteristic),
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
    '5.5': Drawing('Pitch rate of a whole walk', gaits.whole_walk, gaits.WHOLE_WALK),
    '5.6': Drawing(
        'Gait-3 without control, and with ankle control', gaits.without_and_with_ankle, WALKS
    ),
    '5.7': Drawing('Gait-3 with ankle and hip control', gaits.with_ankle_and_hip, WALKS),
    '5.8': Drawing(
        'Spectra without control, and with ankle control', spectra.without_and_with_ankle, WALKS
    ),
    '5.9': Drawing('Spectra with ankle and hip control', spectra.with_ankle_and_hip, WALKS),
    '5.10': Drawing('Phase of the large lines of Gait-3', spectra.phases, WALKS),
    '5.11': Drawing(
        'Dominant frequencies against the inclination', spectra.dominant_frequencies, WALKS
    ),
    '5.12': Drawing('Spectra by ankle and hip gain', spectra.gains, spectra.GAIN_EXPERIMENTS),
    '5.13': Drawing('Smooth and rubber soles, ankle control', spectra.ankle_on_soles, SOLES),
    '5.14': Drawing(
        'Smooth and rubber soles, ankle and hip control', spectra.ankle_and_hip_on_soles, SOLES
    ),
    'amplitude_by_slope': Drawing(
        'Amplitude of the pitch rate against the inclination, by centre of mass',
        vibration.amplitude_by_slope,
        measure=vibration.measure_amplitudes,
        quick=partial(
            vibration.measure_amplitudes, shifts=(0.0, 0.01), slopes_deg=(0, 2, 4, 5), seeds=1
        ),
    ),
    'capture_point': Drawing(
        'Largest push by feet, flywheel and steps, models', models.capture_point
    ),
    'friction': Drawing('Largest inclination against the friction', balance.friction),
    'gain_unit': Drawing('Gain unit of both loops, identified', models.gain_unit),
    'harmonics': Drawing('Harmonics from gravity against the inclination', models.harmonics),
    'line_11': Drawing(
        'What raises line 11 of the gait, 4.74 Hz',
        lines.line_11,
        ('line_11',),
        measure=measure_line_11,
    ),
    'lines': Drawing(
        'Origin of the spectral lines', lines.origin_of_lines, ('lines',), measure=explain_all
    ),
    'open_loops': Drawing(
        'Bode plots of the open loops of ankle and hip',
        vibration.open_loops,
        measure=vibration.measure_loops,
    ),
    'push': Drawing(
        'Largest push against the gain, models',
        pushes.impulses_of_thesis,
        measure=limits.impulses_of_thesis,
    ),
    'push_robot': Drawing(
        'Largest push against the gain, robot and models',
        pushes.largest_pushes,
        measure=limits.largest_pushes,
        quick=partial(
            limits.largest_pushes,
            durations=(motions.PUSHED,),
            gyros=('packaged',),
            gains=(limits.GAINS[0], limits.GAINS[-1]),
        ),
    ),
    'stages': Drawing('Staged control on tilting ground', standing.tilting_ground, ('stages',)),
    'stiffness': Drawing("Vibration against the joint's stiffness", models.stiffness),
    'vibration_by_gain': Drawing(
        'Vibration of the walk by band, against the ankle gain',
        vibration.vibration_by_gain,
        measure=vibration.measure_bands,
        quick=partial(vibration.measure_bands, gains=(0.0, 6.0, 12.0, 18.0), seeds=1),
    ),
}


def drawing_of(number: str) -> Drawing:
    """Return the drawing of a figure."""
    if number not in FIGURES:
        raise KhrError(f'figure: {number!r} is not known; accepted: {ALL}, {", ".join(FIGURES)}')
    return FIGURES[number]


def expand_numbers(asked: Sequence[str]) -> list[str]:
    """Return the requested figures, each once.

    Args:
        asked: numbers; ``all`` stands for all figures, and 3.11 also for 3.11b.
    """
    found: dict[str, None] = {}
    for number in asked:
        parts = [each for each in FIGURES if each[:-1] == number and each[-1].isalpha()]
        chosen = list(FIGURES) if number == ALL else [number] if number in FIGURES else parts
        if not chosen:
            drawing_of(number)  # raises
        found.update(dict.fromkeys(chosen))
    return list(found)


def paths(
    number: str, out: Path, engine: str = engines.DEFAULT, robot: str = ''
) -> tuple[Path, Path]:
    """Return the paths of a figure's PNG and CSV in a folder."""
    name = '_'.join((f'figure_{number.replace(".", "_")}', *_differing(number, engine, robot)))
    return out / f'{name}.png', out / f'{name}.csv'


def _differing(number: str, engine: str, robot: str) -> list[str]:
    """Return the names of engine and robot of a figure, each if it is not the default one."""
    names = [label_of(robot), engine if engine != engines.DEFAULT else '']
    return [name for name in names if name and drawing_of(number).of_robot]


def draw(
    number: str,
    out: Path,
    runs: dict[str, Runs] | None = None,
    fast: bool = False,
    signal: str | None = None,
    engine: str = engines.DEFAULT,
    columns: int | None = None,
    note: Callable[[str], object] = lambda text: None,
    robot: str = '',
) -> list[Path]:
    """Draw a figure and write it as picture and CSV.

    Args:
        number: number of the figure in the thesis, or the name of an additional figure.
        out: output folder, or the picture, .png, .pdf or .svg; the folder is made if needed.
        runs: by experiment, at least those of the figure; None for a figure of the models.
        fast: whether to draw the coarse form if there is one.
        signal: the pitch rate to show, one of RATES; by default the figure's own.
        engine: physics engine of the runs and of the measurement.
        columns: width for a paper, without a heading, as .pdf and .svg always are; 1 or 2.
        note: is called with the heading and notes of a figure without them.
        robot: constants of another robot of the runs and the measurement, by name or file.

    Returns:
        The paths of the picture and the CSV.
    """
    drawing = drawing_of(number)
    if signal is not None and signal not in RATES:
        raise KhrError(f'signal: {signal!r} is not known; accepted: {", ".join(RATES)}')
    image, points = paths(number, out, engine, robot)
    if out.suffix in PICTURES:
        image, points = out, out.with_suffix('.csv')
    make_folder(image.parent)
    with styled():
        needed = {name: (runs or {})[name] for name in drawing.experiments}
        rate = [RATES[signal]] if signal and drawing.rate else []
        figure = drawing.draw(
            *([needed] if needed else []), *rate, engine=engine, fast=fast, robot=robot
        )
        if others := _differing(number, engine, robot):
            head(figure, f'{figure.get_suptitle()}; {", ".join(others)}')
        write_points(figure, points)
        if columns is not None or image.suffix in VECTOR:
            note(remove_heading(figure))
        if columns is not None:
            set_columns(figure, columns)
        with written(image) as part:
            save(figure, part)
    return [image, points]


def run_experiments(
    numbers: Sequence[str], fast: bool = False, engine: str = engines.DEFAULT, robot: str = ''
) -> dict[str, Runs]:
    """Run the missing runs of the experiments of figures; return all their runs by experiment.

    Raises:
        RunError: if the computation was aborted; finished runs are kept.
    """
    one_of('--engine', engine, [*engines.LIBRARIES])
    constants_of(robot)  # an unknown robot is refused before anything is run
    for number in numbers:
        drawing_of(number).check_robot(robot)
    needed = {name: None for number in numbers for name in drawing_of(number).experiments}
    sweeps = experiments.sweeps_of([*needed], fast, engine, robot)
    experiments.run_sweeps(sweeps, check_workers(None))
    return experiments.runs_by_name(needed, fast, engine, robot)
