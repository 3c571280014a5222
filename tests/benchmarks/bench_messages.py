"""Time the twin with the middleware, and what a graph computes that the twin does not.

No graph of these messages can fall below it.

``python -m tests.benchmarks.bench_messages``
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import count, repeat
from math import sin
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from unittest.mock import patch

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from khr_analysis.node_specs import FFT_ANALYSER, RECORDER
from khr_analysis.outcome import MonitorParameters, OutcomeMonitor
from khr_analysis.recording import Recording
from khr_analysis.spectrum import FftAnalyserParameters, SpectrumAnalyser
from khr_bringup.graph.following import nodes_of
from khr_bringup.graph.run_registry import registered
from khr_bringup.node_registry import spec_of
from khr_bringup.offline import ControlLoop
from khr_common.cdr import MessageTemplate, clock, numbers_of, transforms
from khr_common.interfaces import BODY, JOINTS, TF, WORLD, Topic
from khr_common.nodes.messages import blank_message, message_class, serialized
from khr_common.nodes.node import DATA
from khr_sim.node_specs import SIMULATOR, TRANSFORMS
from khr_sim.plant import Plant
from khr_sim.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_sim.transforms import JointTree, TransformsParameters
from tests.benchmarks.bench_graph import (
    EACH,
    EACH_RECORDED,
    ONE,
    ONE_RECORDED,
    SECONDS,
    SHORT,
    TWIN,
)
from tests.benchmarks.clock import WALL, Numbers, log

NAMES = nodes_of(SHORT, record=True)
CONTROL_PERIOD = SHORT.table(RunParameters).control_period
PERIODS = round(SECONDS / CONTROL_PERIOD)
PATIENCE = 120.0  # s
READY = 'ready'


class Bare(Node):  # type: ignore[misc]
    """A node that reads the numbers of a period's messages, and then publishes its own, zeros.

    Between them it does what it has to do beside the twin: :data:`OWN_WORK`. A recorder writes
    what it takes.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        given, taken = topics(name)
        self._senders = [
            (
                self.create_publisher(message_class(topic.kind), topic.name, DATA),
                MessageTemplate(serialized(blank_message(topic))),
            )
            for topic in given
        ]
        self._folder = TemporaryDirectory()
        use = _written(taken, Path(self._folder.name)) if name == RECORDER.name else numbers_of
        for topic in taken:
            self.create_subscription(
                message_class(topic.kind),
                topic.name,
                partial(self._take, use(topic)),
                DATA,
                raw=True,
            )
        self._awaited = self._missing = len(taken)
        self._work = OWN_WORK.get(name, _no_work)(self)

    def matched(self, readers: Counter[Topic]) -> bool:
        """Return whether all who take its messages have found it."""
        given, _ = topics(self.get_name())
        return all(
            publisher.get_subscription_count() == readers[topic]
            for topic, (publisher, _) in zip(given, self._senders, strict=True)
        )

    def answer(self) -> None:
        """Publish the messages of a period."""
        for publisher, template in self._senders:
            publisher.publish(template.filled(0, [0.0] * template.count))

    def _take(self, use: Callable[[bytes], object], data: bytes) -> None:
        use(data)
        self._missing -= 1
        if not self._missing:
            self._missing = self._awaited
            next(self._work)
            self.answer()


class Source(Bare):
    """The bare simulator: in each period it runs the whole twin, and counts."""

    def __init__(self) -> None:
        super().__init__(SIMULATOR.name)
        self.done = Future()
        self._twin = periods()
        self._left, self._began = PERIODS, 0.0

    def answer(self) -> None:
        """Run the twin for a period and publish its messages, so many times."""
        self._began = self._began or perf_counter()
        self._left -= 1
        if self._left < 0:
            self.done.set_result(perf_counter() - self._began)
        else:
            next(self._twin)
            super().answer()


def _written(
    topics: Sequence[Topic], folder: Path
) -> Callable[[Topic], Callable[[bytes], object]]:
    """Return what writes the messages of each topic into a bag."""
    recording = Recording(folder / 'bag')
    for topic in topics:
        recording.add_topic(topic.name, topic.kind)
    return lambda topic: lambda data: recording.write(topic.name, data, clock(data))


def _no_work(_: Node) -> Iterator[None]:
    return repeat(None)


def _spectra(_: Node) -> Iterator[None]:
    analyser = SpectrumAnalyser(SHORT.table(FftAnalyserParameters))
    for period in count():
        analyser.add(period * CONTROL_PERIOD, sin(period))
        yield


def _frames(node: Node) -> Iterator[None]:
    parameters, tree = SHORT.table(TransformsParameters), JointTree(Robot.load())
    publisher = node.create_publisher(message_class(TF.kind), TF.name, DATA)
    torso, joints = (
        MessageTemplate(*transforms(frames)) for frames in (((WORLD, BODY),), tree.moving)
    )
    for period in count():
        if period % parameters.every == 0:
            publisher.publish(torso.filled(period, [0.0] * 7))
            publisher.publish(joints.filled(period, tree.moved([0.0] * len(JOINTS))))
        yield


OWN_WORK = {FFT_ANALYSER.name: _spectra, TRANSFORMS.name: _frames}  # by node, period by period


def periods() -> Iterator[None]:
    """Return the offline twin at the start of a run; each step is a control period."""
    twin = _periods()
    next(twin)
    return twin


def _periods() -> Iterator[None]:
    plant, loop = Plant(SHORT.table(RunParameters)), ControlLoop(SHORT)
    monitor = OutcomeMonitor(SHORT.table(MonitorParameters))
    truth = plant.start(loop.reference(0.0))
    while True:
        yield
        plant.answer(loop.answer(truth))
        monitor.update(truth.stamp_ns, loop.signals)
        truth = plant.advance()


def topics(name: str) -> tuple[list[Topic], list[Topic]]:
    """Return what a node publishes in every period, and what it takes of the others."""
    published = {
        topic
        for each in NAMES
        for topic in spec_of(each).brought(SHORT.table(spec_of(each).table))
        if topic.flow == 'period'
    }
    if name == RECORDER.name:
        return [], list(published)
    spec = spec_of(name)
    brought = spec.brought(SHORT.table(spec.table))
    return (
        [topic for topic in brought if topic in published],
        [topic for topic in spec.subscribes if topic in published],  # what it may need at any time
    )


def measure() -> dict[str, Numbers]:
    """Return simulated by wall time of the twin, alone and among bare nodes."""
    log('bare messages: none')
    seconds = {TWIN: _alone()}
    for case, recorded, run in (
        (ONE, False, _in_one),
        (ONE_RECORDED, True, _in_one),
        (EACH, False, _in_processes),
        (EACH_RECORDED, True, _in_processes),
    ):
        log(f'bare messages: {case}')
        seconds[case] = run(nodes_of(SHORT, recorded))
    return {case: {WALL: PERIODS * CONTROL_PERIOD / took} for case, took in seconds.items()}


def _alone() -> float:
    twin = periods()
    began = perf_counter()
    for _ in range(PERIODS):
        next(twin)
    return perf_counter() - began


def _in_one(names: Sequence[str]) -> float:
    with _context():
        source = Source()
        return _passed(source, [source, *(Bare(name) for name in _others(names))], names)


def _in_processes(names: Sequence[str]) -> float:
    with ExitStack() as stack:
        # as in a run: by itself the middleware finds no more than a few processes of a machine
        run = stack.enter_context(registered('benchmark of messages', Path('.')))
        stack.enter_context(patch.dict(os.environ, run.environment()))
        stack.enter_context(_context())
        others = [_started(stack, name, names) for name in _others(names)]
        source = Source()
        _match([source], names)
        for process in others:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == READY
        return _passed(source, [source], names)


def _others(names: Sequence[str]) -> list[str]:
    return [name for name in names if name != SIMULATOR.name]


@contextmanager
def _context() -> Iterator[None]:
    rclpy.init()
    try:
        yield
    finally:
        rclpy.shutdown()


def _passed(source: Source, nodes: Sequence[Bare], names: Sequence[str]) -> float:
    """Return how long all periods take, s."""
    _match(nodes, names)
    for _ in range(1 + SHORT.table(RunParameters).control_delay):  # which it may be ahead
        source.answer()
    _spin(nodes, source.done)
    for node in nodes:
        node.destroy_node()  # or the nodes of the next case would find these
    return float(source.done.result())


def _started(stack: ExitStack, name: str, names: Sequence[str]) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, '-m', 'tests.benchmarks.bench_messages', name, *names],
        stdout=subprocess.PIPE,
        text=True,
    )
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def _match(nodes: Sequence[Bare], names: Sequence[str]) -> None:
    """Wait until everybody has found who takes its messages."""
    readers = Counter(topic for name in names for topic in topics(name)[1])
    while not all(node.matched(readers) for node in nodes):
        rclpy.spin_once(nodes[0], timeout_sec=0.01)


def _spin(nodes: Sequence[Bare], done: Future) -> None:
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    executor.spin_until_future_complete(done, PATIENCE)
    if not done.done():
        raise TimeoutError(f'{PERIODS} periods: not through within {PATIENCE:g} s')


def main() -> None:
    """Measure once and print; with names, be the first of these nodes."""
    if not sys.argv[1:]:
        for case, found in measure().items():
            print(f'{case:40}{found[WALL]:8.1f}')
        return
    with _context():
        node = Bare(sys.argv[1])
        _match([node], sys.argv[2:])
        print(READY, flush=True)
        _spin([node], Future())


if __name__ == '__main__':
    main()
