"""Run a bout offline: the cores of both robots, called in turn, in one world."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from khr_analysis.outcome import Outcome
from khr_analysis.referee import Referee
from khr_bringup.bout.bout import Bout
from khr_bringup.bout.result import BoutResult, Round, fight
from khr_bringup.changes import Change
from khr_bringup.offline import BEFORE, SIMULATOR, ControlLoop, LiveParameters
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError, RunError
from khr_sim.physics.truth import GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import REFEREE, RunParameters

# Called at each sample of a round, from 0, with state and control loop of each robot.
Watch = Callable[[int, Mapping[str, GroundTruth], Mapping[str, ControlLoop]], object]


class Influences(NamedTuple):
    """Influences on a robot from outside while a round goes on."""

    changes: tuple[Change, ...] = ()  # of parameters
    pushes: tuple[str, ...] = ()  # as of a scenario


def run_bout(
    bout: Bout,
    watch: Watch | None = None,
    influences: Mapping[tuple[int, str], Influences] = MappingProxyType({}),
    ended: Callable[[int, Round], object] = lambda *_: None,
) -> BoutResult:
    """Run the rounds of a bout as fast as the physics goes, without a graph.

    Args:
        bout: to run.
        watch: called at each sample.
        influences: by round, from 0, and robot.
        ended: called with each round, from 0, once it is decided.

    Raises:
        RunError: if a robot's code fails; the text names the robot.
    """

    def run_round(number: int) -> Round:
        own = {robot: influences.get((number, robot), Influences()) for robot in bout.robots}
        result = _run_round(bout, number, watch, own)
        ended(number, result)
        return result

    return fight(bout, run_round)


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
