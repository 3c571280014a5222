"""The offline twin: the same cores as the nodes', called in turn, without ROS."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from khr_analysis.outcome import MonitorParameters, Outcome, OutcomeMonitor
from khr_balance.gait import gait_of
from khr_balance.gait_parameters import GaitParameters
from khr_bringup.errors import BringupError
from khr_bringup.node_registry import spec_of
from khr_bringup.scenario import Scenario
from khr_common.block import Block, Numbers
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    CLOCK,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    JOINT_REFERENCE,
    STAGE,
    Topic,
)
from khr_sim.plant import Plant, mix
from khr_sim.run_parameters import GAIT, RunParameters
from khr_sim.truth import SIGNALS, Truth

Watch = Callable[[Truth, 'ControlLoop', Outcome], object]  # called at each instant of a run


@dataclass(frozen=True)
class OfflineResult:
    """How a run ended: the monitor's outcome, the trajectory hash and the last instant in s."""

    outcome: Outcome
    trajectory_hash: str
    time: float
    end: str


def duration(scenario: Scenario) -> float:
    """Return how long the scenario's run lasts in s: its own duration, or the motion's."""
    own = scenario.table(RunParameters).duration
    return float(own or gait_of(scenario.table(GaitParameters)).duration)


class ControlLoop:
    """The blocks of a scenario's sensors and controllers: from a truth to the target it asks for.

    Attributes:
        signals: what each topic carried at the last instant.

    Raises:
        BringupError: if a block needs a topic that no node of the run publishes.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._blocks: list[tuple[Block[Any], tuple[Topic, ...]]] = []
        self.signals: dict[Topic, Numbers] = {}
        known = set(SIGNALS)
        for node in scenario.nodes:
            spec = spec_of(node)
            if spec.block is None:
                continue
            block = spec.block(scenario.table(spec.table))
            for topic in set(block.needs) - known:
                raise BringupError(
                    f'{scenario.name}: {node} needs the topic {topic.name}, which no node of this '
                    f'run publishes; accepted: a scenario with the node that does'
                )
            published = tuple(topic for topic in spec.publishes if topic.flow == 'period')
            self._blocks.append((block, published))
            known |= set(published)
            if node == GAIT:
                self._gait = block
        self._corrections = [
            topic
            for node in scenario.answers[1:]
            for topic in spec_of(node).publishes
            if topic.flow == 'period'
        ]

    def reference(self, time: float) -> list[float]:
        """Return the gait's 17 joint angles in rad at ``time`` s."""
        return list(self._gait.update(time, {CLOCK: ()})[0])

    def answer(self, truth: Truth) -> list[float]:
        """Return the mixed target, 17 joint angles in rad, that answers ``truth``."""
        time, signals = truth.stamp_ns / 1e9, truth.signals()
        for block, topics in self._blocks:
            signals.update(zip(topics, block.update(time, signals), strict=True))
        self.signals = signals
        return mix(
            signals[JOINT_REFERENCE],
            [dict(zip(topic.names, signals[topic], strict=True)) for topic in self._corrections],
        )

    @property
    def pitch_rate(self) -> float:
        """Return the pitch rate as the board reads it, rad/s."""
        return self.signals[GYRO][1]

    @property
    def forces(self) -> Numbers:
        """Return the normal forces that the sensors read, N, in the order of the regions."""
        return [self.signals[topic][2] for topic in FOOT_FORCES]

    @property
    def corrections(self) -> Numbers:
        """Return the corrections of the ankles and of the hips, rad."""
        return [self.signals[topic][0] for topic in (ANKLE_CORRECTION, HIP_CORRECTION)]

    @property
    def stage(self) -> Numbers:
        """Return stage and inclination in rad as the stage node has them; zeros without one."""
        return self.signals.get(STAGE, (0.0, 0.0))[:2]


def run_offline(scenario: Scenario, watch: Watch | None = None) -> OfflineResult:
    """Run a scenario as fast as the physics goes.

    Args:
        scenario: what to run.
        watch: called with the truth, the control loop and the outcome so far of each instant.
    """
    parameters = replace(scenario.table(RunParameters), duration=duration(scenario))
    plant = Plant(parameters)
    try:
        return _run(scenario, plant, ControlLoop(scenario), watch)
    finally:
        plant.world.close()


def _run(
    scenario: Scenario, plant: Plant, loop: ControlLoop, watch: Watch | None
) -> OfflineResult:
    monitor = OutcomeMonitor(scenario.table(MonitorParameters))
    delayed = plant.parameters.control_delay > 0
    _set_imports_aside()
    due = loop.reference(0.0)  # what the board holds before the first answer
    truth = plant.start(due)
    while True:
        answer = loop.answer(truth)
        outcome = monitor.update(truth.stamp_ns, loop.signals)
        if watch is not None:
            watch(truth, loop, outcome)
        if plant.end:
            return OfflineResult(outcome, plant.trajectory_hash, truth.stamp_ns / 1e9, plant.end)
        truth = plant.advance(due if delayed else answer)
        due = answer


@cache
def _set_imports_aside() -> None:
    """Keep what has been imported out of garbage collections, which outlast many periods."""
    gc.freeze()
