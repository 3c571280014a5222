"""What the runs of a reproduction tell beyond the thesis: soles, friction, staged control."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import takewhile
from math import nan
from statistics import median

from khr_balance.ankle import AnkleControllerParameters
from khr_balance.gait_parameters import GaitParameters
from khr_balance.hip import HipControllerParameters
from khr_balance.stage import STAGES, StageParameters
from khr_bringup.scenario import Scenario, Values
from khr_experiments.experiments import Run, Runs, by
from khr_experiments.sweeps.trial import complete
from khr_sim.run_parameters import RunParameters

SEEDS = ('seed', 'initial_tilt_deg')
STAGED = 'staged, '


@dataclass(frozen=True)
class Tally:
    """What runs alike but for their seeds come to; figures are medians without falls."""

    runs: int
    fell: int
    slip_mm: float
    vibration: float

    @property
    def stays(self) -> bool:
        """Say whether most of them stay up."""
        return 2 * self.fell <= self.runs

    @property
    def text(self) -> str:
        """Tell it in a few words."""
        if not self.stays:
            return f'falls ({self.fell} of {self.runs})'
        return (
            f'stays up ({self.runs - self.fell} of {self.runs}), slip {self.slip_mm:.0f} mm, '
            f'vibration {self.vibration:.3f} rad/s'
        )


def tally(runs: Iterable[Run]) -> Tally:
    """Count runs; one that several experiments have made counts once, by its trajectory."""
    rows = list({run.row['trajectory_hash']: run.row for run in runs}.values())
    kept = [row for row in rows if row['verdict'] != 'fell']
    return Tally(
        len(rows),
        len(rows) - len(kept),
        1000.0 * median([row['largest_slip_m'] for row in kept] or [nan]),
        median([row['vibration_rad_s'] for row in kept] or [nan]),
    )


def added(runs: Mapping[str, Runs]) -> list[str]:
    """Return a line for each thing that the runs tell beyond the thesis."""
    done = [run for some in runs.values() for run in some if run.row.get('verdict')]
    walks = [run for run in done if run.scenario.table(GaitParameters).motion == 'walk']
    return [*_soles(walks), *_friction(walks), *_tilting(done)]


def control(scenario: Scenario) -> str:
    """Name the control of a scenario."""
    ankle, hip = scenario.table(AnkleControllerParameters), scenario.table(HipControllerParameters)
    stage = scenario.table(StageParameters)
    last = stage.fixed_stage if stage.mode == 'fixed' else STAGES[-1]
    words = [f'K_A {ankle.gain:g}'] if ankle.enabled and (last > 1 or not ankle.staged) else []
    words += [f'K_H {hip.gain:g}'] if hip.enabled and (last > 2 or not hip.staged) else []
    return (STAGED if stage.mode == 'auto' else '') + (', '.join(words) or 'no control')


def _soles(walks: Runs) -> list[str]:
    """Compare walks on rubber with their twins on smooth ground."""
    told = []
    for twins in _alike(walks, ('surface',)):
        surfaces = by(twins, lambda run: str(run.scenario.table(RunParameters).surface))
        if {'smooth', 'rubber'} <= set(surfaces):
            rubber, smooth = tally(surfaces['rubber']), tally(surfaces['smooth'])
            told.append(
                f'{_where(twins[0].scenario)} it {rubber.text} on rubber, and '
                f'{smooth.text} on smooth soles'
            )
    return [f'**Rubber soles**: {"; ".join(told)}.'] if told else []


def _friction(walks: Runs) -> list[str]:
    """Tell how steep the ground may be for each friction, of walks that are otherwise alike."""
    told = []
    for twins in _alike(walks, ('friction', 'inclination_deg')):
        frictions = by(twins, lambda run: float(run.scenario.table(RunParameters).sole_friction))
        if len(frictions) > 1:
            listed = '; '.join(
                f'{value:g}: {_steepest(frictions[value])}' for value in sorted(frictions)
            )
            told.append(f'**Friction** ({control(twins[0].scenario)}): {listed}.')
    return told


def _steepest(runs: Runs) -> str:
    """Tell the steepest ground up to which most seeds stay up wherever they were tried."""
    grounds = by(runs, lambda run: float(run.scenario.table(RunParameters).inclination_deg))
    stayed = list(
        takewhile(
            lambda each: each[1].stays, ((phi, tally(grounds[phi])) for phi in sorted(grounds))
        )
    )
    if not stayed:
        return f'falls at {min(grounds):g} deg already'
    phi, there = stayed[-1]
    return f'stays up to {phi:g} of {max(grounds):g} deg, slip {there.slip_mm:.0f} mm there'


def _tilting(runs: Runs) -> list[str]:
    """Compare controls on ground that tilts ever more: how steep it was at the fall."""
    growing = [
        run for run in runs if run.scenario.table(RunParameters).inclination_rate_deg_s > 0.0
    ]
    told = []
    for name, some in by(growing, lambda run: control(run.scenario)).items():
        fell = [_reached(run) for run in some if run.row['verdict'] == 'fell']
        ends = (
            f'falls at {median(fell):.2f} deg'
            if 2 * len(fell) > len(some)
            else f'stays up to {median(_reached(run) for run in some):.2f} deg, where it ended'
        )
        vibration = median(run.row['vibration_rad_s'] for run in some)
        told.append(f'{name} {ends} (vibration {vibration:.3f} rad/s)')
    return (
        [f'**Staged control**, on ground that tilts on and on: {"; ".join(told)}.']
        if any(each.startswith(STAGED) for each in told)
        else []
    )


def _reached(run: Run) -> float:
    """Return the inclination at the fall, or at the end, deg."""
    simulator = run.scenario.table(RunParameters)
    fell = run.row['fell_at_s']
    time = run.row['time_s'] if fell is None else fell
    return float(simulator.inclination_deg + simulator.inclination_rate_deg_s * time)


def _where(scenario: Scenario) -> str:
    return f'at {scenario.table(RunParameters).inclination_deg:g} deg ({control(scenario)})'


def _alike(runs: Runs, but: tuple[str, ...]) -> list[Runs]:
    """Group the runs whose parameters are the same but for the seeds and those named."""
    return list(
        by(
            runs,
            lambda run: json.dumps(
                _without(complete(run.scenario), (*SEEDS, *but)), sort_keys=True
            ),
        ).values()
    )


def _without(values: Values, keys: tuple[str, ...]) -> Values:
    return {
        node: {key: value for key, value in held.items() if key not in keys}
        for node, held in values.items()
    }
