"""Fight many bouts, and compare each fighter with the same one without a means of balance.

Set before the bouts were fought: a fighter does *better* with a means than without, in the same
fight, if the 95 % interval of the difference shows more victories or fewer defeats, and neither
fewer victories nor more defeats; *worse* in the reverse case. The controller wins fights if with
K_A :data:`JUDGED` more than half of the compared fights on the quick engine are better; it loses
them if more than half are worse.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from khr_analysis.referee import BLUE, DRAW, RED, ROBOTS
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.bout.bout import Bout, load_bout
from khr_bringup.bout.offline import run_bout
from khr_common.signals import generator
from khr_studies.measuring.condition import INITIAL_TILT_DEG
from khr_studies.measuring.kept_pool import kept_pool
from khr_studies.measuring.run_table import measure, newcombe
from khr_sweeps.trial import Row

QUICK, CHECK = 'mujoco', 'bullet'
GAINS = (0.0, 12.0, 18.0)  # K_A
JUDGED = 12.0  # K_A of the criterion, with which the thesis's robot walks down 8.88 deg
SHOVE, WALK_UP, DUEL = 'shove', 'walk_up', 'duel'  # bouts
STAND, GUARD = 'stand', 'guard'  # stances of blue
BACK, SIDE, TURN = 0.010, 0.010, 5.0  # m, m and deg: largest errors of a start
DELAY = 2.0  # s, largest delay of a robot in a duel: one period of the shove
# Time of a round, s, where it is not that of the bout: a fall in the last movement is counted out.
LIMITS = {SHOVE: 10.5, WALK_UP: 18.0}
CHECKS = 20  # bouts of a cell on the engine of the check
ROOT = Path('runs/fights')


@dataclass(frozen=True)
class Fight:
    """The condition of a cell: all but the draws of each bout."""

    bout: str  # name of a bout that is shipped
    # red_ka, blue_ka: ankle gain of each robot; 0 is no control
    red_ka: float
    blue_ka: float
    stance: str = ''  # motion of blue; empty for that of the bout
    recovery: bool = False  # whether blue may step
    engine: str = QUICK  # of the physics

    def settings(self, seed: int) -> list[str]:
        """Return the settings of one bout, as ``khr bout --set`` takes them.

        Robots start up to :data:`BACK` further apart than in the bout's file, up to :data:`SIDE`
        aside and turned by up to :data:`TURN`; in a duel each robot waits up to :data:`DELAY`
        longer. All fights with one seed have the same draws.
        """
        draw = generator(seed, 'fights').uniform
        rules = load_bout(self.bout).rules
        made = [f'simulator.seed={seed}', f'simulator.initial_tilt_deg={INITIAL_TILT_DEG}']
        for robot, start, back in ((RED, rules.red_start, -1.0), (BLUE, rules.blue_start, 1.0)):
            x, y, heading = start
            place = (
                round(x + back * draw(0.0, BACK), 4),
                round(y + draw(-SIDE, SIDE), 4),
                round(heading + draw(-TURN, TURN), 2),
            )
            made.append(f'referee.{robot}_start={list(map(float, place))}')
            delay = round(GaitParameters.start_delay + draw(0.0, DELAY), 3)
            if self.bout == DUEL:
                made.append(f'{robot}.gait.start_delay={delay}')
        if self.bout in LIMITS:
            made.append(f'referee.time_limit={LIMITS[self.bout]}')
        for robot, gain in zip(ROBOTS, (self.red_ka, self.blue_ka), strict=True):
            node = f'{robot}.ankle_controller'
            made += [f'{node}.gain={gain}'] if gain else [f'{node}.enabled=false']
        made += [f'{BLUE}.gait.motion={self.stance}'] if self.stance else []
        made += [f'{BLUE}.recovery.enabled=true'] if self.recovery else []
        return made

    def bout_of(self, seed: int) -> Bout:
        """Return one bout."""
        engine = f'simulator.engine={self.engine}'
        return load_bout(self.bout).set_to([engine, *self.settings(seed)])


CELL = tuple(Fight.__dataclass_fields__)  # columns that name a cell
# Bout, stance and recovery: the legs are too short for a step out of the guard.
DEFENCES = (
    (SHOVE, STAND, False),
    (SHOVE, STAND, True),
    (SHOVE, GUARD, False),
    (WALK_UP, STAND, False),
    (WALK_UP, GUARD, False),
)
PLAN = (
    *(Fight(DUEL, red, blue) for red in GAINS for blue in GAINS),
    *(
        Fight(bout, JUDGED, gain, stance, recovery)
        for bout, stance, recovery in DEFENCES
        for gain in GAINS
    ),
    *(
        Fight(bout, gain, JUDGED, stance)
        for bout, stance, recovery in DEFENCES
        for gain in GAINS
        if gain != JUDGED and not recovery
    ),
)
CHECKED = (
    *(Fight(DUEL, red, blue, engine=CHECK) for red in (0.0, JUDGED) for blue in (0.0, JUDGED)),
    *(
        Fight(SHOVE, JUDGED, gain, STAND, recovery, CHECK)
        for recovery in (False, True)
        for gain in (0.0, JUDGED)
    ),
)


def study(bouts: int = 50, workers: int | None = None) -> pd.DataFrame:
    """Fight a number of bouts in each cell; return one table with a row for each bout.

    A command that was interrupted goes on where it stopped.
    """
    with kept_pool(__name__, 'fights', workers, ROOT) as kept:
        return measure(
            kept,
            fight_once,
            [
                ({**asdict(fight), 'seed': seed}, (fight.bout_of(seed),))
                for seed in range(1, 1 + bouts)
                for fight in (*PLAN, *(CHECKED if seed <= CHECKS else ()))
            ],
        )


def fight_once(bout: Bout) -> Row:
    """Fight a bout of one round; return its end, and when each robot fell."""
    (only,) = run_bout(bout).rounds
    winner, reason, time = only.decision
    fell = {f'{robot}_fell_at_s': each.fell_at for robot, each in only.outcomes.items()}
    return {'winner': winner, 'reason': reason, 'time_s': time, **fell}


def counted(runs: pd.DataFrame) -> pd.DataFrame:
    """Count the bouts of each cell: a row with ``bouts``, the victories and the falls.

    Columns ``red``, ``draw`` and ``blue`` are the bouts by their winner, ``red_fell`` and
    ``blue_fell`` those in which the robot was down at the end.
    """
    shown = runs[[*CELL]].fillna({'stance': ''})
    flags = {name: (runs['winner'] == name).astype(int) for name in (RED, DRAW, BLUE)}
    falls = {f'{each}_fell': runs[f'{each}_fell_at_s'].notna().astype(int) for each in ROBOTS}
    cells = shown.assign(bouts=1, **flags, **falls).groupby([*CELL], sort=False).sum()
    return cells.reset_index()


class Means(NamedTuple):
    """A means of balance: a column of the cells with its value without and with it."""

    robot: str
    column: str
    without: Any
    with_value: Any


MEANS = (
    *(Means(robot, f'{robot}_ka', 0.0, gain) for gain in GAINS[1:] for robot in ROBOTS),
    Means(BLUE, 'stance', STAND, GUARD),
    Means(BLUE, 'recovery', False, True),
)


def compared(cells: pd.DataFrame) -> list[Row]:
    """Compare the cells that differ in one means alone; see :func:`effect`.

    Returns:
        For each pair the row of the cell with the means, extended by the comparison: ``robot``,
        ``column``, ``without``, ``with_value``, ``won`` and ``lost`` (difference of the shares with
        its interval), ``effect``.
    """
    table = {tuple(row[name] for name in CELL): row for row in cells.to_dict('records')}
    found = []
    for means in MEANS:
        place = CELL.index(means.column)
        for key, row in table.items():
            before = table.get((*key[:place], means.without, *key[place + 1 :]))
            if key[place] == means.with_value and before is not None:
                found.append({**row, **means._asdict(), **_differences(means.robot, before, row)})
    return found


def _differences(robot: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Row:
    other = BLUE if robot == RED else RED
    won, lost = (
        newcombe(after[each], after['bouts'], before[each], before['bouts'])
        for each in (robot, other)
    )
    return {'won': won, 'lost': lost, 'effect': effect(won, lost)}


def effect(won: tuple[float, float, float], lost: tuple[float, float, float]) -> str:
    """Return how a change affects a fighter: ``better``, ``worse``, ``both`` or ``none``.

    Args:
        won: change of the share of bouts won: value, lower and upper bound.
        lost: change of the share of bouts lost, likewise.
    """
    better = won[1] > 0.0 or lost[2] < 0.0
    worse = won[2] < 0.0 or lost[1] > 0.0
    return 'both' if better and worse else 'better' if better else 'worse' if worse else 'none'


def verdict(comparisons: list[Row]) -> str:
    """Return the verdict of the criterion on comparisons: ``wins``, ``loses`` or ``neither``."""
    effects = [row['effect'] for row in comparisons]
    if effects.count('better') > len(effects) / 2:
        return 'wins'
    return 'loses' if effects.count('worse') > len(effects) / 2 else 'neither'


def judged(comparisons: list[Row]) -> list[Row]:
    """Return the comparisons of the criterion."""
    return [
        row
        for row in comparisons
        if row['column'].endswith('_ka') and row['with_value'] == JUDGED and row['engine'] == QUICK
    ]
