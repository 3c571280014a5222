"""Run a bout offline: the cores of both robots, called in turn, in one world."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from khr_analysis.outcome import Outcome
from khr_analysis.outcome_values import values_of
from khr_analysis.referee import DRAW, Decision, Referee
from khr_bringup.bout.bout import Bout
from khr_bringup.changes import Change
from khr_bringup.offline import BEFORE, SIMULATOR, ControlLoop, LiveParameters
from khr_bringup.scenario.scenario import Scenario
from khr_common.arithmetic import in_force
from khr_common.errors import KhrError, RunError
from khr_common.files import write_text
from khr_sim.physics.truth import GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import REFEREE, RunParameters

FILE = 'bout.json'
# Called at each sample of a round, from 0, with state and control loop of each robot.
Watch = Callable[[int, Mapping[str, GroundTruth], Mapping[str, ControlLoop]], object]


class Influences(NamedTuple):
    """Influences on a robot from outside while a round goes on."""

    changes: tuple[Change, ...] = ()  # of parameters
    pushes: tuple[str, ...] = ()  # as of a scenario


@dataclass(frozen=True)
class Round:
    """The result of a round."""

    decision: Decision
    outcomes: Mapping[str, Outcome]  # of each robot
    # SHA-256 in hex over the states of both robots at every control period, red's ahead of blue's
    trajectory_hash: str
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


def run_bout(
    bout: Bout,
    watch: Watch | None = None,
    influences: Mapping[tuple[int, str], Influences] = MappingProxyType({}),
) -> BoutResult:
    """Run the rounds of a bout as fast as the physics goes, without a graph.

    Args:
        bout: to run.
        watch: called at each sample.
        influences: by round, from 0, and robot.

    Raises:
        RunError: if a robot's code fails; the text names the robot.
    """
    return fight(
        bout,
        lambda number: _run_round(
            bout,
            number,
            watch,
            {robot: influences.get((number, robot), Influences()) for robot in bout.robots},
        ),
    )


def fight(bout: Bout, run_round: Callable[[int], Round]) -> BoutResult:
    """Run the rounds of a bout until one robot has won more than half of them.

    Args:
        bout: to run.
        run_round: runs a round, from 0.
    """
    result = BoutResult(bout, [])
    for number in range(bout.rules.rounds):
        result.rounds.append(run_round(number))
        if max(result.won.values(), default=0) > bout.rules.rounds / 2:
            break
    return result


def write_bout(folder: Path, result: BoutResult) -> None:
    """Write ``bout.json`` of a bout."""
    write_text(folder / FILE, json.dumps(result.to_json(), indent=2) + '\n')


def _run_round(
    bout: Bout, number: int, watch: Watch | None, influences: Mapping[str, Influences]
) -> Round:
    robots = {
        name: _pushed(scenario, influences[name].pushes)
        for name, scenario in bout.in_round(number).items()
    }
    referee, decision = Referee(bout.rules), None
    plant = Plant([each.table(RunParameters) for each in robots.values()], bout.starts)
    try:
        loops = {name: ControlLoop(each) for name, each in robots.items()}
        live = [
            LiveParameters(robots[name], loop, influences[name].changes)
            for name, loop in loops.items()
        ]
        _change(BEFORE, live, plant)
        began = time.monotonic()
        states = plant.start([loop.reference(0.0) for loop in loops.values()])
        while True:
            truths = dict(zip(robots, states, strict=True))
            targets, outcomes = list[list[float]](), dict[str, Outcome]()
            for name, loop in loops.items():
                try:
                    targets.append(loop.answer(truths[name]))
                except RunError as error:  # it begins with the node
                    raise RunError(f'{name}/{error}') from error
                except KhrError as error:
                    raise RunError(f'{name}: {error}') from error
                assert loop.outcome is not None
                outcomes[name] = loop.outcome
            if watch is not None:
                watch(number, truths, loops)
            now = states[0].stamp_ns / 1e9
            places = {name: truth.position.tolist() for name, truth in truths.items()}
            decision = decision or referee.judge(now, outcomes, places)
            plant.answer(targets, REFEREE if decision else '')
            if plant.end:
                assert decision is not None
                wall_time = time.monotonic() - began
                return Round(decision, outcomes, plant.trajectory_hash, wall_time)
            _change(states[0].stamp_ns, live, plant)
            states = plant.advance()
    finally:
        plant.close()


def _change(instant_ns: int, live: Sequence[LiveParameters], plant: Plant) -> None:
    """Make the changes of all robots after a sample."""
    if any([each.act(instant_ns) for each in live]):
        plant.configure([each.scenario.table(RunParameters) for each in live])


def _pushed(scenario: Scenario, pushes: Sequence[str]) -> Scenario:
    timed = [text for text in scenario.table(RunParameters).pushes if text]
    return scenario.changed({(SIMULATOR, 'pushes'): [*timed, *pushes]}) if pushes else scenario
