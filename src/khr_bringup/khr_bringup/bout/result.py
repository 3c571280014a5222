"""The result of a bout, round by round, and its file."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from khr_analysis.outcome import Outcome
from khr_analysis.outcome_values import values_of
from khr_analysis.referee import DRAW, Decision
from khr_bringup.bout.bout import Bout
from khr_common.arithmetic import in_force
from khr_common.files import write_text

FILE = 'bout.json'


@dataclass(frozen=True)
class Round:
    """The result of a round."""

    decision: Decision
    outcomes: Mapping[str, Outcome]  # of each robot
    # SHA-256 in hex over the states of both robots at every control period, red's ahead of blue's
    trajectory_hash: str
    length: float  # simulated time of its last sample, s
    wall_time: float  # s, from the first sample on
    warnings: tuple[str, ...] = ()  # errors that nodes reported


@dataclass(frozen=True)
class BoutResult:
    """The result of a bout."""

    bout: Bout
    rounds: list[Round]

    @property
    def won(self) -> Counter[str]:
        """Return how many rounds each robot has won."""
        return Counter(
            each.decision.winner for each in self.rounds if each.decision.winner != DRAW
        )

    @property
    def winner(self) -> str:
        """Return the winner of most rounds: red, blue or draw."""
        first, *second = [*self.won.most_common(2), (DRAW, 0)][:2]
        return DRAW if first[1] == (second[0][1] if second else 0) else first[0]

    @property
    def warnings(self) -> list[str]:
        """Return the errors that nodes reported."""
        return [
            f'round {number}: {text}'
            for number, each in enumerate(self.rounds, 1)
            for text in each.warnings
        ]

    @property
    def real_time_factor(self) -> float:
        """Return simulated over wall time."""
        wall_time = sum(each.wall_time for each in self.rounds)
        return sum(each.decision.time for each in self.rounds) / max(wall_time, 1e-9)

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``bout.json``: numbers in SI units."""
        return {
            'bout': self.bout.name,
            'winner': self.winner,
            'rounds': [
                {
                    'winner': each.decision.winner,
                    'reason': each.decision.reason,
                    'time_s': each.decision.time,
                    **{
                        robot: {'verdict': outcome.verdict, **values_of(outcome)}
                        for robot, outcome in each.outcomes.items()
                    },
                    'trajectory_hash': each.trajectory_hash,
                }
                for each in self.rounds
            ],
            'real_time_factor': round(self.real_time_factor, 3),
            'arithmetic': in_force(),
        }


def fight(bout: Bout, run_round: Callable[[int, float], Round]) -> BoutResult:
    """Run the rounds of a bout until one robot has won more than half of them.

    Args:
        bout: to run.
        run_round: runs a round; takes its number, from 0, and the length of the rounds before, s.
    """
    result = BoutResult(bout, [])
    for number in range(bout.rules.rounds):
        before = sum(each.length for each in result.rounds)
        result.rounds.append(run_round(number, before))
        if max(result.won.values(), default=0) > bout.rules.rounds / 2:
            break
    return result


def write_bout(folder: Path, result: BoutResult) -> None:
    """Write ``bout.json`` of a bout."""
    write_text(folder / FILE, json.dumps(result.to_json(), indent=2) + '\n')
