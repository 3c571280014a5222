"""The offline twin: the same cores as the nodes', called in turn, without ROS."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby
from operator import attrgetter
from typing import Any

from khr_analysis.outcome import MonitorParameters, Outcome, OutcomeMonitor
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.changes import Change
from khr_bringup.node_registry import controllers, spec_of
from khr_bringup.result import Result
from khr_bringup.scenario.scenario import Scenario
from khr_common.block import Block, Numbers, error_text
from khr_common.errors import KhrError, RunError
from khr_common.interfaces import CLOCK, FOOT_FORCES, GYRO, JOINT_REFERENCE, STAGE, Topic, mix
from khr_sim.physics.truth import SIGNALS, GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import GAIT, RunParameters

SIMULATOR, MONITOR = 'simulator', 'monitor'
BEFORE = -1  # stamp before the first sample, ns
Watch = Callable[[GroundTruth, 'ControlLoop', Outcome], object]  # called at each sample of a run
Truths = Mapping[str, GroundTruth]  # by the name of the robot
Loops = Mapping[str, 'ControlLoop']


def duration(scenario: Scenario) -> float:
    """Return how long the scenario's run lasts in s: its own duration, or the motion's."""
    own = scenario.table(RunParameters).duration
    return float(own or gait_of(scenario.table(GaitParameters)).duration)


class ControlLoop:
    """The blocks of a scenario, from the truth to the target of the joints, and the judge.

    Args:
        scenario: with the parameters of each block.
        nodes: with the blocks to use; all nodes of the scenario by default.

    Attributes:
        signals: the last sample of each topic.
        outcome: of the run so far; None before the first sample.

    Raises:
        KhrError: if a block needs a topic that no node of the run publishes.
    """

    def __init__(self, scenario: Scenario, nodes: Collection[str] | None = None) -> None:
        self._blocks: list[tuple[Block[Any], tuple[Topic, ...]]] = []
        self._by_node: dict[str, Block[Any]] = {}
        self.signals: dict[Topic, Numbers] = {}
        self._monitor = OutcomeMonitor(scenario.table(MonitorParameters))
        self.outcome: Outcome | None = None
        known = set(SIGNALS)
        for node in scenario.nodes:
            spec = spec_of(node)
            if spec.block is None or (nodes is not None and node not in nodes):
                continue
            block = spec.block(scenario.table(spec.table))
            for topic in set(block.needs) - known:
                raise KhrError(
                    f'{scenario.name}: {node} needs the topic {topic.name}, which no node of this '
                    f'run publishes; accepted: a scenario with the node that does'
                )
            published = tuple(topic for topic in spec.publishes if topic.flow == 'period')
            self._blocks.append((block, published))
            self._by_node[node] = block
            known |= set(published)
        self._corrections = [controllers()[node] for node in scenario.answers[1:]]
        self._controllers = tuple(scenario.corrections.values())

    def reference(self, time: float) -> list[float]:
        """Return the gait's 17 joint angles in rad at ``time`` s."""
        return list(self._by_node[GAIT].update(time, {CLOCK: ()})[0])

    def configure(self, node: str, scenario: Scenario) -> None:
        """Pass changed parameters to a node's block, if it has one, or to the judge."""
        if node == MONITOR:
            self._monitor.configure(scenario.table(MonitorParameters))
        elif node in self._by_node:
            self._by_node[node].configure(scenario.table(spec_of(node).table))

    def observe(self, truth: GroundTruth) -> Outcome:
        """Pass a sample of the truth to the blocks and the judge; return the outcome so far."""
        time, signals = truth.stamp_ns / 1e9, truth.signals()
        try:
            for block, topics in self._blocks:
                signals.update(zip(topics, block.update(time, signals), strict=True))
        except MemoryError:
            raise
        except Exception as error:
            node = next(name for name, each in self._by_node.items() if each is block)
            if isinstance(error, KhrError):
                raise type(error)(f'{node}: {error}') from error
            raise RunError(f'{node}: {error_text(type(block), error)}') from error
        self.signals = signals
        self.outcome = self._monitor.update(truth.stamp_ns, signals)
        return self.outcome

    def answer(self, truth: GroundTruth) -> list[float]:
        """Return the mixed target, 17 joint angles in rad, that answers ``truth``."""
        self.observe(truth)
        signals = self.signals
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
        """Return the correction of each controller, rad, in the order of its scenario's."""
        return [self.signals[topic][0] for topic in self._controllers]

    @property
    def stage(self) -> Numbers:
        """Return the stage and its estimated inclination in rad; zeros without a stage node."""
        return self.signals.get(STAGE, (0.0, 0.0))[:2]


class LiveParameters:
    """The parameters of a robot, which change while it runs.

    Args:
        scenario: at the start.
        loop: that takes the changes.
        changes: to make.

    Attributes:
        scenario: with the changes so far.
    """

    def __init__(
        self, scenario: Scenario, loop: ControlLoop, changes: Iterable[Change] = ()
    ) -> None:
        self.scenario, self._loop = scenario, loop
        after = attrgetter('after_ns')
        self._due = {at: list(each) for at, each in groupby(sorted(changes, key=after), key=after)}

    def act(self, instant_ns: int) -> bool:
        """Make the changes after a sample; return whether some are of the simulator."""
        made = self._due.pop(instant_ns, None)
        if made is None:  # a scenario takes a while to check
            return False
        self.scenario = self.scenario.changed(
            {(each.node, each.parameter): each.value for each in made}
        )
        nodes = {each.node for each in made}
        for node in nodes:
            self._loop.configure(node, self.scenario)
        return SIMULATOR in nodes


def run_offline(
    scenario: Scenario, watch: Watch | None = None, changes: Sequence[Change] = ()
) -> Result:
    """Run a scenario as fast as the physics goes; it is always judged.

    Args:
        scenario: to run.
        watch: called with the truth, the control loop and the outcome so far of each sample.
        changes: of parameters while it runs.
    """
    began = time.monotonic()
    parameters = replace(scenario.table(RunParameters), duration=duration(scenario))
    plant = Plant([parameters])
    try:
        loop = ControlLoop(scenario)

        def take(truths: Truths) -> str:
            if watch is not None and loop.outcome is not None:
                watch(truths[''], loop, loop.outcome)
            return ''

        wall_time = run_plant(plant, {'': loop}, [LiveParameters(scenario, loop, changes)], take)
        assert loop.outcome is not None
        return Result(
            scenario=scenario,
            judged=loop.outcome,
            trajectory_hash=plant.trajectory_hash,
            end=plant.end,
            time=plant.truths[0].stamp_ns / 1e9,
            startup=time.monotonic() - began - wall_time,
            wall_time=wall_time,
        )
    finally:
        plant.close()


def run_plant(
    plant: Plant, loops: Loops, live: Sequence[LiveParameters], take: Callable[[Truths], str]
) -> float:
    """Run a plant under the control loops of its robots to its end; return the wall time, s.

    Args:
        plant: not started.
        loops: of the robots; the name is empty of one robot alone.
        live: the parameters of each robot.
        take: called with the state of each robot at each sample, once the loops have answered;
            returns the reason to end the run, empty if it goes on.

    Raises:
        RunError: if a robot's code fails; the text names the robot.
    """

    def change(instant_ns: int) -> None:
        if any([each.act(instant_ns) for each in live]):
            tables = [each.scenario.table(RunParameters) for each in live]
            length = plant.parameters[0].duration
            plant.configure([replace(table, duration=length) for table in tables])

    with _imports_set_aside():
        change(BEFORE)
        started = time.monotonic()
        states = plant.start([loop.reference(0.0) for loop in loops.values()])
        while True:
            truths = dict(zip(loops, states, strict=True))
            targets = [_answer(name, loop, truths[name]) for name, loop in loops.items()]
            plant.answer(targets, take(truths))
            if plant.end:
                return time.monotonic() - started
            change(states[0].stamp_ns)
            states = plant.advance()


def _answer(robot: str, loop: ControlLoop, truth: GroundTruth) -> list[float]:
    """Return the answer of a robot's loop; an error of a robot with a name begins with it."""
    try:
        return loop.answer(truth)
    except KhrError as error:
        if not robot:
            raise
        # a RunError begins with the node
        separator = '/' if isinstance(error, RunError) else ': '
        raise RunError(f'{robot}{separator}{error}') from error


@contextmanager
def _imports_set_aside() -> Iterator[None]:
    """Freeze imported objects: a full garbage collection takes longer than many periods.

    The caller's objects are frozen too; all are unfrozen at the end, unless the caller had frozen
    objects before.
    """
    own = gc.get_freeze_count() == 0
    if own:
        gc.freeze()
    try:
        yield
    finally:
        if own:
            gc.unfreeze()
