"""What a page says of the same condition must agree: who stays up, and who does not.

A figure, a row of the scoreboard and a limit may show the same robot on the same ground. They name
motion, soles, gains, inclination, seed, and what else is varied; nothing that they leave unsaid may
decide whether the robot stays up.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import Changes, Condition
from khr_studies.measuring.experiments import Runs, group_by
from khr_sweeps.trial import complete

# What pages do not name.
UNSAID = (('gait', 'start_delay'), ('simulator', 'initial_tilt_deg'))


@dataclass(frozen=True)
class Said:
    """What one source says of one run.

    Attributes:
        source: where it is said, in words.
        condition: as named, with all else that was changed; the inclination of a robot that
            faces uphill is its amount.
        inclination_deg, seed: of the run.
        stayed_up: whether the robot neither fell nor rode down the board.
    """

    source: str
    condition: Condition
    inclination_deg: float
    seed: int
    stayed_up: bool


def said_of_runs(runs: Mapping[str, Runs]) -> Iterator[Said]:
    """Yield what the runs of experiments say, by the names of the experiments."""
    for name, some in runs.items():
        for run in some:
            if run.row.get('verdict') is None:
                continue
            condition, inclination_deg, seed = named(run.scenario)
            yield Said(f'experiment {name}', condition, inclination_deg, seed, run.stayed_up)


def named(scenario: Scenario) -> tuple[Condition, float, int]:
    """Return condition, inclination in deg and seed of a scenario as pages name them."""
    condition, inclination_deg = Condition.of(scenario)
    seed = scenario.table(RunParameters).seed
    plain, own = (complete(each) for each in (condition.scenario(inclination_deg, seed), scenario))
    changes: Changes = tuple(
        ((node, key), tuple(value) if isinstance(value, list) else value)
        for node, values in own.items()
        for key, value in values.items()
        if value != plain[node][key] and (node, key) not in UNSAID
    )
    return replace(condition, changes=changes), inclination_deg, seed


def contradictions(said: Iterable[Said]) -> list[str]:
    """Return a line for each run that stays up by one source, and does not by another."""
    found = []
    places = group_by(said, lambda one: (one.condition, round(one.inclination_deg, 6), one.seed))
    for (condition, inclination_deg, seed), some in places.items():
        up = sorted({one.source for one in some if one.stayed_up})
        down = sorted({one.source for one in some if not one.stayed_up})
        if up and down:
            found.append(
                f'{_title(condition)} at {inclination_deg:g} deg, seed {seed}: stays up by '
                f'{", ".join(up)}, not by {", ".join(down)}'
            )
    return found


def check(said: Iterable[Said], kept: Path) -> None:
    """Refuse results that contradict one another, and print each pair on stderr.

    Args:
        said: all that a page would say.
        kept: folder of the results.

    Raises:
        RunError: if one says that the robot stays up where another says that it does not.
    """
    found = contradictions(said)
    for line in found:
        print(f'khr: {line}', file=sys.stderr)
    if found:
        raise RunError(
            f'no page is written: of its results {len(found)} contradict others, as above; remove '
            f'{kept} and repeat the command'
        )


def ragged(said: Iterable[Said]) -> list[str]:
    """Return a line for each condition and seed lost on gentler ground than it stays up on."""
    found = []
    for (condition, seed), some in group_by(said, lambda one: (one.condition, one.seed)).items():
        steepest = max((one.inclination_deg for one in some if one.stayed_up), default=0.0)
        lost = sorted(
            {
                one.inclination_deg
                for one in some
                if not one.stayed_up and one.inclination_deg < steepest
            }
        )
        if lost:
            grounds = ', '.join(f'{phi:g}' for phi in lost)
            found.append(
                f'{_title(condition)}, seed {seed}: lost at {grounds} deg, stays up at '
                f'{steepest:g} deg'
            )
    return sorted(found)


def _title(condition: Condition) -> str:
    changes = (f'{node}.{key} {value}' for (node, key), value in condition.changes)
    return ', '.join((condition.title, *changes))
