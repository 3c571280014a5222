"""The findings of a reproduction as data: the scoreboard, and what the runs add to the thesis."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import takewhile
from statistics import median

from khr_balance.ankle import AnkleControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.hip import HipControllerParameters
from khr_balance.stage import STAGES, StageParameters
from khr_bringup.scenario.scenario import Scenario
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.experiments import Run, Runs, group_by
from khr_studies.peak_origin.odd_line import OddLine
from khr_studies.peak_origin.published_peaks import PeakOrigin
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.stability_map.best_gain import BestGains, MapLimits, SoleEffect, count_cell
from khr_sweeps.trial import complete

SEEDS = ('seed', 'initial_tilt_deg')


@dataclass(frozen=True)
class Tally:
    """Runs that differ only in their seeds.

    Attributes:
        runs, lost: number of runs, and of those that did not stay up.
        slip_mm, vibration: medians of the others, None if there are none; rad/s.
    """

    runs: int
    lost: int
    slip_mm: float | None
    vibration: float | None

    @property
    def stays(self) -> bool:
        """Return whether at least half of them stay up."""
        return 2 * self.lost <= self.runs


@dataclass(frozen=True)
class SoleComparison:
    """Walks on rubber soles beside the same walks on smooth ones."""

    inclination_deg: float
    control: str
    rubber: Tally
    smooth: Tally


@dataclass(frozen=True)
class FrictionComparison:
    """How steep the ground may be with one friction.

    Attributes:
        steepest_deg: up to here most runs stay up wherever they were tried; None if they do not on
            the flattest ground tried.
        tried_deg: flattest and steepest ground tried.
        slip_mm: median at ``steepest_deg``.
    """

    control: str
    friction: float
    steepest_deg: float | None
    tried_deg: tuple[float, float]
    slip_mm: float | None


@dataclass(frozen=True)
class TiltComparison:
    """Standing on ground whose inclination grows.

    Attributes:
        staged: whether the control follows the inclination in stages.
        stays: whether at least half of the runs stay up.
        deg: median inclination at the end: of those that did not stay up, if most did not.
        vibration: median, rad/s.
    """

    control: str
    staged: bool
    stays: bool
    deg: float
    vibration: float


@dataclass(frozen=True)
class Findings:
    """What a reproduction found.

    Attributes:
        scoreboard: None if it was not measured.
        soles, friction, tilting: comparisons of runs beyond the thesis's own.
        peaks: origin of the published control frequencies; empty if it was not looked for.
        odd_lines: what raises line 11, 4.74 Hz; empty if it was not tried.
        maps: best gains, or the effect of rubber soles, by the name of the map.
        figures, runs: how many were made.
        run_seconds: computing time of all runs, s.
        fast: whether this is the quick form with few seeds.
        command: repeats the reproduction.
        versions: of the code and the libraries, by name.
    """

    scoreboard: Scoreboard | None
    soles: tuple[SoleComparison, ...]
    friction: tuple[FrictionComparison, ...]
    tilting: tuple[TiltComparison, ...]
    peaks: tuple[PeakOrigin, ...]
    odd_lines: tuple[OddLine, ...]
    maps: dict[str, BestGains | SoleEffect | MapLimits]
    figures: int
    runs: int
    run_seconds: float
    fast: bool
    command: str
    versions: dict[str, str]


def tally(runs: Iterable[Run]) -> Tally:
    """Count runs; a run that belongs to several experiments counts once, by its trajectory."""
    rows = {run.row['trajectory_hash']: run.row for run in runs}.values()
    cell = count_cell(None, None, [*rows])
    slip_mm = None if cell.slip is None else 1000.0 * cell.slip
    return Tally(cell.runs, cell.runs - cell.up, slip_mm, cell.vibration)


def finished(runs: Mapping[str, Runs]) -> Runs:
    """Return the runs of all experiments that have an outcome."""
    return [run for some in runs.values() for run in some if run.row.get('verdict')]


def control(scenario: Scenario) -> str:
    """Name the gains of a scenario."""
    ankle, hip = scenario.table(AnkleControllerParameters), scenario.table(HipControllerParameters)
    stage = scenario.table(StageParameters)
    last = stage.fixed_stage if stage.mode == 'fixed' else STAGES[-1]
    words = [f'K_A {ankle.gain:g}'] if ankle.enabled and (last > 1 or not ankle.staged) else []
    words += [f'K_H {hip.gain:g}'] if hip.enabled and (last > 2 or not hip.staged) else []
    return ', '.join(words) or 'no control'


def compare_soles(runs: Iterable[Run]) -> tuple[SoleComparison, ...]:
    """Compare walks on rubber with the same walks on smooth soles."""
    found = []
    for twins in _alike(_walks(runs), 'surface'):
        soles = group_by(twins, lambda run: str(run.scenario.table(RunParameters).surface))
        if {'smooth', 'rubber'} <= set(soles):
            scenario = twins[0].scenario
            found.append(
                SoleComparison(
                    _inclination_deg(twins[0]),
                    control(scenario),
                    tally(soles['rubber']),
                    tally(soles['smooth']),
                )
            )
    return tuple(found)


def compare_friction(runs: Iterable[Run]) -> tuple[FrictionComparison, ...]:
    """Find how steep the ground may be for each friction of walks that are otherwise alike."""
    found = []
    for twins in _alike(_walks(runs), 'friction', 'inclination_deg'):
        frictions = group_by(
            twins, lambda run: float(run.scenario.table(RunParameters).sole_friction)
        )
        if len(frictions) > 1:
            found += [_with_friction(value, frictions[value]) for value in sorted(frictions)]
    return tuple(found)


def compare_tilting(runs: Iterable[Run]) -> tuple[TiltComparison, ...]:
    """Compare controls on ground whose inclination grows; nothing without staged control."""
    tilting = group_by(
        (run for run in runs if run.scenario.table(RunParameters).inclination_rate_deg_s > 0.0),
        lambda run: (control(run.scenario), run.scenario.table(StageParameters).mode == 'auto'),
    )
    if not any(staged for _, staged in tilting):
        return ()
    return tuple(_on_tilting_ground(*key, group) for key, group in tilting.items())


def _with_friction(friction: float, runs: Runs) -> FrictionComparison:
    grounds = sorted(
        (phi, tally(group)) for phi, group in group_by(runs, _inclination_deg).items()
    )
    stayed = list(takewhile(lambda ground: ground[1].stays, grounds))
    steepest, there = stayed[-1] if stayed else (None, None)
    return FrictionComparison(
        control(runs[0].scenario),
        friction,
        steepest,
        (grounds[0][0], grounds[-1][0]),
        there.slip_mm if there else None,
    )


def _on_tilting_ground(name: str, staged: bool, runs: Runs) -> TiltComparison:
    lost = [_reached_deg(run) for run in runs if not run.stayed_up]
    stays = 2 * len(lost) <= len(runs)
    return TiltComparison(
        name,
        staged,
        stays,
        median(map(_reached_deg, runs) if stays else lost),
        median(run.row['vibration_rad_s'] for run in runs),
    )


def _walks(runs: Iterable[Run]) -> Runs:
    return [run for run in runs if run.scenario.table(GaitParameters).motion == 'walk']


def _inclination_deg(run: Run) -> float:
    return float(run.scenario.table(RunParameters).inclination_deg)


def _reached_deg(run: Run) -> float:
    """Return the inclination at the fall, or at the end, deg."""
    fell = run.row['fell_at_s']
    time = run.row['time_s'] if fell is None else fell
    rate = run.scenario.table(RunParameters).inclination_rate_deg_s
    return float(_inclination_deg(run) + rate * time)


def _alike(runs: Runs, *free: str) -> list[Runs]:
    """Group runs that have all parameters in common but the seeds and those named."""

    def fixed(run: Run) -> str:
        values = {
            node: {key: value for key, value in given.items() if key not in (*SEEDS, *free)}
            for node, given in complete(run.scenario).items()
        }
        return json.dumps(values, sort_keys=True)

    return list(group_by(runs, fixed).values())
