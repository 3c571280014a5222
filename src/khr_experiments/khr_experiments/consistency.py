"""What a page says of the same condition must agree: who stays up, and who falls.

A figure, a row of the scoreboard and a limit may show the same robot on the same ground. They name
motion, soles, gains, inclination, seed, and what else is varied; nothing that they leave unsaid may
decide whether the robot falls.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from khr_bringup.scenario import Scenario
from khr_common import RunError
from khr_experiments.condition import Changes, Condition
from khr_experiments.experiments import Runs, by
from khr_sim.run_parameters import RunParameters
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
        survived: whether the robot had not fallen at the end.
    """

    source: str
    condition: Condition
    inclination_deg: float
    seed: int
    survived: bool


def said_of_runs(runs: Mapping[str, Runs]) -> Iterator[Said]:
    """Yield what the runs of experiments say, by the names of the experiments."""
    for name, some in runs.items():
        for run in some:
            if run.row.get('verdict') is None:
                continue
            condition, inclination_deg, seed = named(run.scenario)
            yield Said(f'experiment {name}', condition, inclination_deg, seed, not run.fell)


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
    """Return a line for each run that one source says stays up, and another that it falls."""
    found = []
    for (condition, inclination_deg, seed), some in by(said, _place).items():
        up = sorted({one.source for one in some if one.survived})
        down = sorted({one.source for one in some if not one.survived})
        if up and down:
            found.append(
                f'{_title(condition)} at {inclination_deg:g} deg, seed {seed}: stays up by '
                f'{", ".join(up)}, falls by {", ".join(down)}'
            )
    return found


def check(said: Iterable[Said], kept: Path) -> None:
    """Refuse results that contradict one another, and print each pair on stderr.

    Args:
        said: all that a page would say.
        kept: folder of the results.

    Raises:
        RunError: if one says that the robot stays up where another says that it falls.
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
    """Return a line for each condition and seed that falls on gentler ground than it survives."""
    found = []
    for (condition, seed), some in by(said, lambda one: (one.condition, one.seed)).items():
        steepest = max((one.inclination_deg for one in some if one.survived), default=0.0)
        falls = sorted(
            {
                one.inclination_deg
                for one in some
                if not one.survived and one.inclination_deg < steepest
            }
        )
        if falls:
            grounds = ', '.join(f'{phi:g}' for phi in falls)
            found.append(
                f'{_title(condition)}, seed {seed}: falls at {grounds} deg, stays up at '
                f'{steepest:g} deg'
            )
    return sorted(found)


def _place(one: Said) -> tuple[Condition, float, int]:
    return one.condition, round(one.inclination_deg, 6), one.seed


def _title(condition: Condition) -> str:
    changes = (f'{node}.{key} {value}' for (node, key), value in condition.changes)
    return ', '.join((condition.title, *changes))
