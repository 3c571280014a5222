"""What is asked of runs: spectra, critical inclinations, sweeps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pyarrow as pa
import yaml

from khr.runs import RunResult, changes_of
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum
from khr_analysis.spectrum import spectrum as spectrum_of
from khr_balance.gait import gait_of
from khr_balance.gait_parameters import GaitParameters
from khr_common import KhrError
from khr_experiments.condition import Condition
from khr_experiments.critical import Limit, measure, workers
from khr_sweeps.folder import read_results
from khr_sweeps.sweep import sweep as run_sweep

RATES = ('gyro_rate', 'pitch_rate')


def spectrum(
    run: RunResult,
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
        settings: parameters of the ``fft_analyser`` node to replace, such as ``window='hann'``.

    Returns:
        Frequencies in Hz, amplitudes in rad/s and phases in rad, (n,) each, and the peaks.

    Raises:
        KhrError: if a value is not accepted, or the part is shorter than eight samples.
    """
    if signal not in RATES:
        raise KhrError(f'signal: {signal!r} is not accepted; accepted: {" | ".join(RATES)}')
    gait = run.scenario.table(GaitParameters)
    first, last = 0.0, float(run.signals.time[-1]) + 1.0
    if gait.motion == 'walk':
        planned = gait_of(gait)
        first, last = planned.cycle(1)[0], planned.cycle(gait.cycles)[1]
    if run.outcome.fell_at is not None:
        last = min(last, run.outcome.fell_at)
    first, last = (
        given if given is not None else own for given, own in ((start, first), (end, last))
    )
    time = run.signals.time
    inside = (time > first - 1e-4) & (time < last - 1e-4)
    parameters = replace(run.scenario.table(FftAnalyserParameters), **settings)
    began = float(time[inside][0]) if inside.any() else first
    return spectrum_of(getattr(run.signals, signal)[inside], parameters, began)


def critical(
    motion: str = 'walk',
    *,
    ankle_gain: float = 0.0,
    hip_gain: float = 0.0,
    surface: str = 'smooth',
    set: Mapping[str, Any] | None = None,
    seeds: int = 3,
    tolerance: float = 0.1,
    jobs: int = 1,
) -> Limit:
    """Measure the critical inclination by bisection over seeds.

    Args:
        motion: ``walk``, or ``leg_lift`` on the pads of the force sensors.
        ankle_gain, hip_gain: K_A and K_H, board units; 0 is no control.
        surface: ``smooth``, ``rubber`` or ``pads``, under a walk.
        set: further parameters to change, by ``node.parameter``.
        seeds: how many.
        tolerance: of each bisection, deg.
        jobs: processes.

    Returns:
        The limit of each seed in deg, with mean and confidence interval, and all attempts.

    Raises:
        KhrError: if a value is not accepted.
    """
    condition = Condition(motion, ankle_gain, hip_gain, surface, tuple(changes_of(set).items()))
    condition.scenario(0.0)  # refuses before anything has been run
    if jobs <= 1:
        return measure(condition, seeds, tolerance)
    with workers(jobs) as pool:
        return measure(condition, seeds, tolerance, pool)


def sweep(
    scenario: str,
    grid: Mapping[str, Sequence[Any]],
    *,
    set: Mapping[str, Any] | None = None,
    seeds: int | None = None,
    workers: int | None = None,
    out: str | PathLike[str] | None = None,
) -> pa.Table:
    """Run a scenario over every combination of some parameters.

    In a script, call it under ``if __name__ == '__main__':``, for the workers import the script.

    Args:
        scenario: name of a scenario, or its file.
        grid: values by ``node.parameter``.
        set: parameters that are the same in all runs.
        seeds: number of seeds of each; the scenario's own by default.
        workers: processes; one per core by default.
        out: folder to keep the results in, so that what is done is not repeated.

    Returns:
        One row per run: the swept values, verdict, distance, slip, vibration, trajectory hash.

    Raises:
        KhrError: if a value is not accepted, or runs are missing at the end.
    """
    request: dict[str, Any] = {
        'scenario': scenario,
        'grid': {
            name: [value for each in values for value in changes_of({name: each}).values()]
            for name, values in grid.items()
        },
        'set': {f'{node}.{key}': value for (node, key), value in changes_of(set).items()},
    }
    request |= {'seeds': seeds} if seeds is not None else {}
    with TemporaryDirectory() as folder:
        file = Path(folder) / 'sweep.yaml'
        file.write_text(yaml.safe_dump(request, sort_keys=False), encoding='utf-8')
        results = Path(out) if out is not None else Path(folder) / 'results'
        if run_sweep(file, results, workers, summary=False):
            raise KhrError(f'{results}: runs are missing; accepted: the same call again')
        return read_results(results)
