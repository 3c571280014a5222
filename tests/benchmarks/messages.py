"""Speed of the twin with the messages of a graph: the bound of every graph of these messages.

``python -m tests.benchmarks.messages NODE NAME ...`` is one of the bare nodes NAME.
"""

import os
import subprocess
import sys
from collections import Counter
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
from khr_analysis.recording import Recording
from khr_analysis.spectrum import FftAnalyserParameters, SpectrumAnalyser
from khr_bringup.graph.following import nodes_of
from khr_bringup.graph.run_registry import registered
from khr_bringup.node_registry import spec_of
from khr_bringup.offline import ControlLoop
from khr_common.cdr import MessageTemplate, clock, numbers_of, transforms
from khr_common.interfaces import BODY, JOINTS, TF, WORLD
from khr_common.nodes.messages import blank_message, message_class, serialized
from khr_common.nodes.node import DATA
from khr_description.robot import Robot
from khr_sim.node_specs import SIMULATOR, TRANSFORMS
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from khr_sim.transforms import JointTree, TransformsParameters
from tests.benchmarks.clock import WALL, log
from tests.benchmarks.graphs import EACH, EACH_RECORDED, ONE, ONE_RECORDED, SECONDS, SHORT, TWIN

CONTROL_PERIOD = SHORT.table(RunParameters).control_period
PERIODS = round(SECONDS / CONTROL_PERIOD)
PATIENCE = 120.0  # s
READY = 'ready'


class Bare(Node):
    """A node that parses the messages of a period, does its extra work and publishes zeros.

    Its extra work is the work that the twin does not do: spectra, frames, recording.
    """

    def __init__(self, name):
        super().__init__(name)
        given, self.taken = topics(name)
        self.given = [
            (
                topic,
                self.create_publisher(message_class(topic.kind), topic.name, DATA),
                MessageTemplate(serialized(blank_message(topic))),
            )
            for topic in given
        ]
        self._folder = TemporaryDirectory()
        use = self._recorded() if name == RECORDER.name else numbers_of
        for topic in self.taken:
            take, kind = partial(self._take, use(topic)), message_class(topic.kind)
            self.create_subscription(kind, topic.name, take, DATA, raw=True)
        self._missing = len(self.taken)
        self._work = EXTRA_WORK.get(name, lambda _: repeat(None))(self)

    def _recorded(self):
        recording = Recording(Path(self._folder.name) / 'bag')
        for topic in self.taken:
            recording.add_topic(topic.name, topic.kind)
        return lambda topic: lambda data: recording.write(topic.name, data, clock(data))

    def matched(self, readers):
        """Return whether all its publishers have found all their subscribers."""
        return all(
            publisher.get_subscription_count() == readers[topic]
            for topic, publisher, _ in self.given
        )

    def answer(self):
        """Publish the messages of a period."""
        for _, publisher, template in self.given:
            publisher.publish(template.filled(0, [0.0] * template.count))

    def _take(self, use, data):
        use(data)
        self._missing -= 1
        if not self._missing:
            self._missing = len(self.taken)
            next(self._work)
            self.answer()


class Source(Bare):
    """The bare simulator: it runs the whole twin in each period."""

    def __init__(self):
        super().__init__(SIMULATOR.name)
        self.done, self._twin, self._left, self._began = Future(), twin(), PERIODS, 0.0

    def answer(self):
        """Run the twin for a period and publish its messages, for all periods."""
        self._began = self._began or perf_counter()
        self._left -= 1
        if self._left < 0:
            self.done.set_result(perf_counter() - self._began)
        else:
            next(self._twin)
            super().answer()


def spectra(_):
    """Compute the spectra of a period in each step."""
    analyser = SpectrumAnalyser(SHORT.table(FftAnalyserParameters))
    for period in count():
        analyser.add(period * CONTROL_PERIOD, sin(period))
        yield


def frames(node):
    """Compute and publish the frames of a period in each step."""
    parameters, tree = SHORT.table(TransformsParameters), JointTree(Robot.load())
    publisher = node.create_publisher(message_class(TF.kind), TF.name, DATA)
    torso, joints = (
        MessageTemplate(*transforms(pairs)) for pairs in (((WORLD, BODY),), tree.moving)
    )
    for period in count():
        if period % parameters.every == 0:
            publisher.publish(torso.filled(period, [0.0] * 7))
            publisher.publish(joints.filled(period, tree.moved([0.0] * len(JOINTS))))
        yield


EXTRA_WORK = {FFT_ANALYSER.name: spectra, TRANSFORMS.name: frames}


def twin():
    """Run the offline twin, a control period in each step; it has been started."""

    def run():
        plant, loop = Plant(SHORT.table(RunParameters)), ControlLoop(SHORT)
        truth = plant.start(loop.reference(0.0))
        while True:
            yield
            plant.answer(loop.answer(truth))
            truth = plant.advance()

    started = run()
    next(started)
    return started


def topics(name):
    """Return the topics that a node publishes in every period, and those that it subscribes to."""
    published = {
        topic
        for each in nodes_of(SHORT, record=True)
        for topic in spec_of(each).brought(SHORT.table(spec_of(each).table))
        if topic.flow == 'period'
    }
    if name == RECORDER.name:
        return [], list(published)
    spec = spec_of(name)
    brought = spec.brought(SHORT.table(spec.table))
    return [topic for topic in brought if topic in published], [
        topic for topic in spec.subscribes if topic in published
    ]


def measure():
    """Return the speed of the twin alone, and among bare nodes in each mode."""
    log('messages: none')
    steps, began = twin(), perf_counter()
    for _ in range(PERIODS):
        next(steps)
    seconds = {TWIN: perf_counter() - began}
    for case, recorded, run in (
        (ONE, False, in_one_process),
        (ONE_RECORDED, True, in_one_process),
        (EACH, False, in_processes),
        (EACH_RECORDED, True, in_processes),
    ):
        log(f'messages: {case}')
        names = nodes_of(SHORT, recorded)
        seconds[case] = run(names, [name for name in names if name != SIMULATOR.name])
    return {case: {WALL: PERIODS * CONTROL_PERIOD / took} for case, took in seconds.items()}


def in_one_process(names, others):
    """Return the wall time of all periods with all nodes in this process, s."""
    with context():
        source = Source()
        return exchanged(source, [source, *map(Bare, others)], names)


def in_processes(names, others):
    """Return the wall time of all periods with a process per node, s."""
    with ExitStack() as stack:
        # The environment of a run: without it, the middleware finds only a few processes.
        run = stack.enter_context(registered('benchmark of messages', Path('.')))
        stack.enter_context(patch.dict(os.environ, run.environment()))
        stack.enter_context(context())
        processes = []
        for name in others:
            command = [sys.executable, '-m', 'tests.benchmarks.messages', name, *names]
            processes.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
            stack.callback(processes[-1].wait)
            stack.callback(processes[-1].kill)
        source = Source()
        match([source], names)
        for process in processes:
            assert process.stdout.readline().strip() == READY
        return exchanged(source, [source], names)


@contextmanager
def context():
    """Initialise ROS, and shut it down."""
    rclpy.init()
    try:
        yield
    finally:
        rclpy.shutdown()


def exchanged(source, nodes, names):
    """Return the wall time of all periods, s."""
    match(nodes, names)
    for _ in range(1 + SHORT.table(RunParameters).control_delay):  # the simulator may run ahead
        source.answer()
    spin(nodes, source.done)
    for node in nodes:
        node.destroy_node()  # or the nodes of the next case would find these
    return source.done.result()


def match(nodes, names):
    """Wait until all publishers have found all their subscribers."""
    readers = Counter(topic for name in names for topic in topics(name)[1])
    while not all(node.matched(readers) for node in nodes):
        rclpy.spin_once(nodes[0], timeout_sec=0.01)


def spin(nodes, done):
    """Spin nodes until a future is done."""
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    executor.spin_until_future_complete(done, PATIENCE)
    if not done.done():
        raise TimeoutError(f'{PERIODS} periods: not done within {PATIENCE:g} s')


if __name__ == '__main__':
    with context():
        bare = Bare(sys.argv[1])
        match([bare], sys.argv[2:])
        print(READY, flush=True)
        spin([bare], Future())
