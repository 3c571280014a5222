"""Studies as functions: spectra of runs, sweeps, the third stage of standing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pyarrow as pa
from pydantic import InstanceOf

from khr.arguments import checked
from khr.runs import RunResult, changes_of, named, prepared
from khr_analysis.sampling import LEAST, samples_at, within
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum
from khr_analysis.spectrum import spectrum as spectrum_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_common import KhrError
from khr_common.checks import one_of
from khr_common.errors import INTERRUPTED
from khr_studies.peak_origin.study import whole_cycles
from khr_studies.third_stage.study import SCALES, TIMES, Plane, measure_plane
from khr_sweeps.pool import check_workers
from khr_sweeps.reading import sweep_from
from khr_sweeps.results.folder import read_results
from khr_sweeps.sweep import run_sweep

RATES = ('gyro_rate', 'pitch_rate')
# The parameters of the node fft_analyser that a spectrum of a given part of a run depends on.
SETTINGS = (
    'window',
    'remove_mean',
    'max_frequency',
    'phase_threshold',
    'peak_count',
    'peak_threshold',
    'fundamental',
)


@checked
def spectrum(
    run: InstanceOf[RunResult],
    signal: str = 'gyro_rate',
    *,
    start: float | None = None,
    end: float | None = None,
    **settings: Any,
) -> Spectrum:
    """Return the spectrum of the torso's pitch rate over a part of a run.

    Args:
        run: from :func:`khr.run` or :func:`khr.load`.
        signal: ``gyro_rate``, as the board reads it and as in the thesis, or ``pitch_rate``, the
            true one; rad/s.
        start: of the part, s; by default the first whole gait cycle of a walk, else 0.
        end: of the part, s; by default the end of the last cycle, or of the run if it fell.
        settings: parameters of the ``fft_analyser`` node to replace, such as ``window='hann'``;
            not those of its sliding window and of its topic.

    Returns:
        Frequencies in Hz, amplitudes in rad/s and as ``amplitude_deg`` in deg/s, phases in rad,
        (n,) each, and the peaks.

    Raises:
        KhrError: if a value is not accepted, or the part is outside the run or shorter than eight
            samples.

    Example:
        >>> import khr
        >>> stand = khr.run('stand_0deg', engine='mujoco', duration=0.6)
        >>> found = khr.spectrum(stand, start=0.3, window='hann')
        >>> found.frequency.shape == found.amplitude_deg.shape
        True
    """
    one_of('signal', signal, RATES)
    for name in settings:
        one_of('spectrum', name, ('signal', 'start', 'end', *SETTINGS))
    changed = {f'fft_analyser.{key}': value for key, value in settings.items()}
    parameters = prepared(run.scenario, changed).table(FftAnalyserParameters)
    gait = run.scenario.table(GaitParameters)
    length = float(run.signals.time[-1])
    first, last = 0.0, length + 1.0
    if gait.cyclic:
        first, last = whole_cycles(gait)
    if run.outcome.fell_at is not None:
        last = min(last, run.outcome.fell_at)
    first, last = (
        given if given is not None else own for given, own in ((start, first), (end, last))
    )
    samples = samples_at(run.signals.time, getattr(run.signals, signal))
    part = within(samples, first, last)
    if len(part.values) < LEAST:
        raise KhrError(
            f'start, end: {first:g}, {last:g} s is not accepted; accepted: a part of the run of '
            f'{length:.3f} s with {LEAST} samples or more'
        )
    return spectrum_of(part.values, replace(parameters, control_period=part.period), part.start)


@checked
def sweep(
    scenario: str | PathLike[str],
    grid: Mapping[str, Any],
    *,
    set: Mapping[str, Any] | None = None,
    engine: str | None = None,
    seeds: int | None = None,
    workers: int | None = None,
    out: str | PathLike[str] | None = None,
    progress: bool = False,
) -> pa.Table:
    """Run a scenario over every combination of some parameters.

    Args:
        scenario: name of a scenario, or its file.
        grid: values by ``node.parameter``.
        set: parameters that are the same in all runs.
        engine: ``bullet`` or ``mujoco``; the scenario's own by default.
        seeds: number of seeds of each; the scenario's own by default. They need
            ``simulator.initial_tilt_deg`` in ``set`` or ``grid``, such as 0.3: the error of placing
            the robot, in deg. With 0, seeds differ by the noise of the sensors alone.
        workers: processes; one per core by default.
        out: folder of the results; runs that are already in it are not repeated.
        progress: whether to show the progress on a terminal, and at the end the count of each
            verdict.

    Returns:
        One row per run: the swept values, verdict, distance, slip, vibration, trajectory hash.

    Raises:
        KhrError: if a value is not accepted, or runs are missing at the end.
        KeyboardInterrupt: after Ctrl-C; with ``out``, finished runs are kept.

    Example:
        >>> import khr
        >>> slopes = {'simulator.inclination_deg': [0, 3]}
        >>> found = khr.sweep('stand_0deg', slopes, set={'simulator.duration': 0.3})
        >>> found['verdict'].to_pylist()
        ['stood', 'stood']
    """
    chosen = named(set, engine=engine)
    request: dict[str, Any] = {
        'scenario': str(scenario),
        'grid': {name: _values(name, values) for name, values in grid.items()},
        'set': {f'{node}.{key}': value for (node, key), value in changes_of(chosen).items()},
    }
    request |= {'seeds': seeds} if seeds is not None else {}
    specification = sweep_from(request, 'sweep')
    with _folder(out) as results:
        code = run_sweep(specification, results, workers, quiet=not progress)
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        if code and out is None:
            raise KhrError('sweep: runs are missing; accepted: out=FOLDER, which keeps the others')
        if code:
            raise KhrError(f'{results}: runs are missing; accepted: the same call again')
        return read_results(results)


@checked
def stage3(
    *,
    scales: Sequence[float] = SCALES,
    times: Sequence[float] = TIMES,
    engine: str = 'mujoco',
    seeds: int = 2,
    workers: int | None = None,
    out: str | PathLike[str] | None = None,
    progress: bool = False,
) -> Plane:
    """Measure how far the hip's damping raises the limit of standing.

    Args:
        scales: of the force sensors, V/N.
        times: time constants of the force sensors, s.
        engine: ``bullet`` or ``mujoco``; some points are measured on the other one too.
        seeds: leg lifts at each inclination.
        workers: processes; one per core by default.
        out: folder for page, data and picture, ``stage3.md`` and so on, in which results are kept.
        progress: whether to show the progress on stderr.

    Returns:
        The limits in deg, (times, scales), without the hip and with its rate.

    Raises:
        KhrError: if a value is not accepted.

    Example:
        >>> import khr
        >>> plane = khr.stage3(scales=[0.008], times=[0.2], seeds=1)
        >>> plane.limits(hip_gain=0.0).shape
        (1, 1)
    """
    check_workers(workers, 'workers')
    with _folder(out) as folder:
        plane = measure_plane(
            seeds, engine, workers, folder / 'jobs', scales, times, quiet=not progress
        )
        if out is not None:
            from khr_studies.third_stage import page  # draws
            from khr_studies.third_stage.comparison import compare_with_model

            page.write(plane, compare_with_model(plane), folder / 'stage3.md')
        return plane


@contextmanager
def _folder(out: str | PathLike[str] | None) -> Iterator[Path]:
    """Yield the given folder, or a temporary one."""
    if out is not None:
        yield Path(out)
        return
    with TemporaryDirectory() as folder:
        yield Path(folder) / 'results'


def _values(name: str, values: Any) -> list[Any]:
    """Return the values of one parameter of a grid.

    Raises:
        KhrError: if they are not several, or not accepted.
    """
    if isinstance(values, str) or not hasattr(values, '__iter__'):
        raise KhrError.refused(f'grid: {name}', values, 'a list of values')
    return [value for each in values for value in changes_of({name: each}).values()]
