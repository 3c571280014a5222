"""Run a bout offline: the cores of both robots, called in turn, in one world."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

from khr_analysis.outcome import Outcome
from khr_analysis.referee import RefereeBlock
from khr_bringup.bout.bout import Bout
from khr_bringup.bout.result import BoutResult, Round, fight
from khr_bringup.changes import Change
from khr_bringup.offline import SIMULATOR, ControlLoop, LiveParameters, Loops, Truths, run_plant
from khr_bringup.scenario.scenario import Scenario
from khr_sim.plant import Plant
from khr_sim.run_parameters import REFEREE, RunParameters

# Called at each sample of a round, from 0, with the simulated time of the rounds before it, s.
Watch = Callable[[int, float, Truths, Loops], object]


class Influences(NamedTuple):
    """Influences on a robot from outside while a round goes on."""

    changes: tuple[Change, ...] = ()  # of parameters
    pushes: tuple[str, ...] = ()  # as of a scenario


def run_bout(
    bout: Bout,
    watch: Watch = lambda *_: None,
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

    def run_round(number: int, before: float) -> Round:
        own = {robot: influences.get((number, robot), Influences()) for robot in bout.robots}
        result = _run_round(bout, number, partial(watch, number, before), own)
        ended(number, result)
        return result

    return fight(bout, run_round)


def _run_round(
    bout: Bout,
    number: int,
    watch: Callable[[Truths, Loops], object],
    influences: Mapping[str, Influences],
) -> Round:
    robots = {
        name: _pushed(scenario, influences[name].pushes)
        for name, scenario in bout.in_round(number).items()
    }
    referee = RefereeBlock(bout.rules)
    plant = Plant([each.table(RunParameters) for each in robots.values()], bout.starts)
    try:
        loops = {name: ControlLoop(each) for name, each in robots.items()}
        live = [
            LiveParameters(robots[name], loop, influences[name].changes)
            for name, loop in loops.items()
        ]

        def outcomes() -> dict[str, Outcome]:
            return {name: loop.outcome for name, loop in loops.items() if loop.outcome}

        def take(truths: Truths) -> str:
            watch(truths, loops)
            seen = {
                topic.under(name): numbers
                for name, truth in truths.items()
                for topic, numbers in truth.signals().items()
            }
            referee.update(plant.truths[0].stamp_ns / 1e9, seen)
            return REFEREE if referee.decision else ''

        wall_time = run_plant(plant, loops, live, take)
        length = plant.truths[0].stamp_ns / 1e9
        assert referee.decision is not None
        return Round(referee.decision, outcomes(), plant.trajectory_hash, length, wall_time)
    finally:
        plant.close()


def _pushed(scenario: Scenario, pushes: Sequence[str]) -> Scenario:
    timed = [text for text in scenario.table(RunParameters).pushes if text]
    return scenario.changed({(SIMULATOR, 'pushes'): [*timed, *pushes]}) if pushes else scenario
