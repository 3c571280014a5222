"""The simulator node: replaces the hardware and publishes the clock."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from math import radians

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import String
from std_srvs.srv import SetBool

from khr_common import KhrError
from khr_common.block import NodeSpec
from khr_common.errors import MalformedError
from khr_common.interfaces import FINISHED, JOINTS, PUSH, PUSHED, READY, STATE, frame_of, full_name
from khr_common.nodes.messages import JointAnswer, read_answer, restamp, status
from khr_common.nodes.node import KhrNode
from khr_common.pacing import Latency, Punctuality
from khr_common.statuses import KEY, read_ready
from khr_sim.lockstep import ASK_AGAIN, Lockstep
from khr_sim.nodes.inputs import Sources, read_push
from khr_sim.nodes.metronome import Metronome
from khr_sim.nodes.truth_publisher import TruthPublisher
from khr_sim.physics.body import Start
from khr_sim.physics.truth import GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import REFEREE, RunParameters

REPORT_PERIOD = 1.0  # s of wall time between diagnostics


class SimulatorNode(KhrNode):
    """Publish the ground truth of each control period, collect the answers, step the physics.

    Of several robots in one world each has its topics in its namespace; the clock is common. The
    state is published at the root too. The referee of a bout is one of the nodes that answer.

    States: ``waiting`` (for the first reference, the first answers and the listeners),
    ``running``, ``paused``, ``finished``.
    """

    parameters: RunParameters
    patience = 20.0

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        own = self.parameters.of_robots()
        self._robots = list(own)  # names; an empty one of a robot alone
        starts = [Start(x, y, radians(heading)) for x, y, heading in self.parameters.starts()]
        self.plant = Plant(list(own.values()), starts)
        urdf = self.plant.world.robot.urdf
        self._outputs = [
            TruthPublisher(self, urdf, robot, clock=not number)
            for number, robot in enumerate(self._robots)
        ]
        spaces = dict.fromkeys(['', *self._robots])
        self._states_out = [self.publisher(STATE.under(space)) for space in spaces]
        self._latency = Latency()
        self._sources = Sources(self._robots, self.parameters.answers)
        self._lockstep: Lockstep[JointAnswer] = Lockstep(
            self._sources.names, self.parameters.listeners
        )
        for source, topic in self._sources.topics.items():
            self.subscribe_bytes(topic, read_answer, partial(self._on_answer, source))
        for space in spaces:
            self.subscribe(READY.under(space), partial(self._on_ready, space))
        self._pushes_out = [self.publisher(PUSHED.under(robot)) for robot in self._robots]
        for number, robot in enumerate(self._robots):
            self.subscribe(PUSH.under(robot), partial(self._on_push, number))
        self.create_service(SetBool, '~/pause', self._on_pause)
        self.by_wall_clock(ASK_AGAIN, self._on_watch)
        on_tick = self._pump if self._in_lockstep else self._on_tick
        self._metronome = Metronome(self, on_tick)
        self._metronome.configure(self.parameters)
        self._started = False
        self._published = self._reported = time.monotonic()
        self._punctuality = Punctuality()
        self._enter('waiting')
        for output in self._outputs:
            output.describe()
        self._begin()
        if not self._started:
            self._outputs[0].tick(0)

    @property
    def _in_lockstep(self) -> bool:
        return self.parameters.sync == 'lockstep'

    def check(self, parameters: RunParameters) -> None:
        """Refuse another tilt that ends a run in a bout: the referee ends its rounds."""
        key = 'stop_when_tilted_deg'
        if len(self._robots) > 1 and getattr(parameters, key) != getattr(self.parameters, key):
            raise KhrError(f'{key}: fixed in a bout; accepted: referee.fall_tilt_deg at its start')

    def configure(self, parameters: RunParameters) -> None:
        """Apply changed parameters from the next control period on."""
        self.plant.configure(list(parameters.of_robots().values()))
        self._metronome.configure(parameters)
        if self._in_lockstep:
            self._pump()  # without a pace nothing else asks for the period that the pace held back

    @property
    def answered_ns(self) -> int:
        """Timestamp reached by the physics; changed parameters act from the next period on."""
        return self.now_ns if self._started else -1

    def finish(self) -> None:
        """Publish the end of the run."""
        self._lockstep.reported()
        if self.state != 'finished':
            self._enter('finished', end='stopped')

    def settled(self) -> bool:
        """Return whether the listeners have all samples, which only this node can republish."""
        return self.failure is not None or self._lockstep.received()

    def close(self) -> None:
        """Release the physics."""
        self.plant.close()

    # ---- the phases of a run ----

    def _begin(self) -> None:
        """Put the robots on the ground, once each gait has given the first reference."""
        given = self._lockstep.barrier.given()
        if self._sources.gaits <= given.keys():
            self._started = True
            self._publish(self.plant.start(self._sources.references(given)))

    def _publish(self, truths: Sequence[GroundTruth]) -> None:
        for output, truth in zip(self._outputs, truths, strict=True):
            output.publish(truth)

    def _repeat(self) -> None:
        for output in self._outputs:
            output.repeat()

    def _pump(self) -> None:
        """Simulate as many periods as the answers allow."""
        try:
            self._go_on()
        except KhrError as error:
            self._abort(str(error))

    def _go_on(self) -> None:
        lockstep = self._lockstep
        if not self._started:
            self._begin()
            if not self._started:
                return
        if self.state == 'waiting' and not lockstep.absent():
            self._enter('running')
        while self.state == 'running' and self._in_lockstep:
            answers = lockstep.barrier.take()
            if answers is not None:
                self._answer(answers)
            if self._over():
                return
            if lockstep.missing(self.plant.ready) or not self._metronome.begins():
                return
            self._advance()

    def _answer(self, answers: Mapping[str, JointAnswer]) -> None:
        """Queue the answers to a sample; corrections are added in the order of the sources."""
        end = REFEREE if self._sources.decided(answers) else ''
        self.plant.answer(self._sources.targets(answers), end)

    def _over(self) -> bool:
        """Return whether the run has ended; publish its end."""
        if self.plant.end:
            self._enter(FINISHED, end=self.plant.end)
        return bool(self.plant.end)

    def _advance(self) -> None:
        truths = self.plant.advance()
        self.now_ns = truths[0].stamp_ns
        self._lockstep.barrier.open(self.now_ns)
        self._lockstep.reported()
        self._published = time.monotonic()
        self._publish(truths)

    # ---- subscriptions ----

    def _on_answer(self, source: str, answer: JointAnswer) -> None:
        gait = source in self._sources.gaits
        if gait and answer.name != JOINTS:
            raise MalformedError('not all joints in their order')
        if (self._lockstep.barrier.first(source, answer.stamp_ns) or answer) != answer:
            self._contradicted(source, answer.stamp_ns)
            return
        if answer.stamp_ns > self._lockstep.barrier.now_ns:
            raise MalformedError('a timestamp ahead of the clock; accepted: that of the sample')
        if not self._lockstep.barrier.put(source, answer.stamp_ns, answer):
            return
        # The first sample is republished until the run starts; its answers have no latency.
        if not gait and self.state == 'running' and answer.stamp_ns == self.now_ns:
            self._latency.add(time.monotonic() - self._published)
        self._pump()

    def _contradicted(self, source: str, stamp_ns: int) -> None:
        """Reject a contradicting answer; end the run if a second publisher may have sent it."""
        topic = self._sources.topics[source]
        if self.publishers_of(topic) > 1:
            problem = f'another answer to t = {stamp_ns / 1e9:.3f} s than before'
            self._abort(f'{topic.name}: {problem}, from {self.senders(topic)}')
        else:
            self.refuse(topic, 'another answer to a sample than before')

    def _on_ready(self, space: str, message: String) -> None:
        name, stamp_ns = read_ready(message.data, self.run)
        if self._lockstep.receipts.take(full_name(space, name), stamp_ns, self.now_ns):
            self._lockstep.reported()
            self._pump()

    def _on_push(self, number: int, message: WrenchStamped) -> None:
        robot = self._robots[number]
        if not self._started:  # the start of the world would drop it
            raise MalformedError('a push before the start of the run')
        try:
            push = read_push(message, self.parameters, self.now_ns, robot)
            self.plant.world.push(push, number)
        except KhrError as error:
            raise MalformedError(str(error)) from error
        message.header.frame_id = frame_of(robot, push.frame)
        restamp(message.header.stamp, round(push.start * 1e9))
        # With its exact start and frame, for the recorder.
        self._pushes_out[number].publish(message)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        able = self.state in ('running', 'paused')
        if able:
            self._enter('paused' if request.data else 'running')
            self._punctuality.rest()
            self._lockstep.reported()
            self._pump()
        response.success, response.message = able, self.state
        return response

    # ---- wall time ----

    def _on_tick(self) -> None:
        """Advance one period in realtime mode, with the answers that are recent enough."""
        if self.state != 'running':
            return
        p = self.parameters
        self._punctuality.tick(time.monotonic(), p.control_period, p.realtime_factor)
        answers = self._lockstep.barrier.newest
        oldest = self.now_ns - round(p.command_timeout * 1e9)
        fresh = {
            source: answer
            for source, answer in answers.items()
            if source in self._sources.gaits or answer.stamp_ns >= oldest
        }
        self._punctuality.stale += len(answers) - len(fresh)
        try:
            self._answer(fresh)
            if not self._over():
                self._advance()
                self._over()
        except KhrError as error:
            self._abort(str(error))

    def _on_watch(self) -> None:
        """Republish the sample if an answer is missing; end the run after the timeout."""
        if self.state == 'waiting':
            self._wait()
        elif self._lockstep.asks() and self.state == 'running' and self._in_lockstep:
            self._ask_again()
        now = time.monotonic()
        if now - self._reported > REPORT_PERIOD:
            self._reported = now
            self._report()

    def _ask_again(self) -> None:
        ready = self.plant.ready
        if not self._lockstep.missing(ready):
            return  # only the pace limits the run
        reason = self._lockstep.late(self.parameters.lockstep_timeout, ready)
        if reason:
            self._abort(reason)
        elif not ready:
            self._repeat()

    def _wait(self) -> None:
        reason = self._lockstep.never_started(self.parameters.start_timeout)
        if reason:
            self._abort(reason)
            return
        if self._started:
            self._repeat()
        else:
            self._outputs[0].tick(0)
        if self._lockstep.absent() != self._absent:
            self._enter('waiting')

    def _abort(self, reason: str) -> None:
        """End the run with an error, published on the topic ``state``."""
        self.fail(reason)
        self._enter('finished', end='error', reason=reason)

    def _enter(self, state: str, end: str = '', reason: str = '') -> None:
        self.state = state
        self._absent = self._lockstep.absent() if state == 'waiting' else []
        values = {
            'time_ns': str(self.now_ns),
            'end': end,
            'reason': reason,
            'waiting_for': ', '.join(self._absent),
            KEY: self.run,
        }
        if state == FINISHED:
            values['trajectory_hash'] = self.plant.trajectory_hash if self._started else ''
            values |= {} if self._in_lockstep else self._punctuality.result().texts()
        if self._absent and not self.run:  # by hand: a run reports it itself
            self.get_logger().info(f'waiting for {values["waiting_for"]}')
        level = DiagnosticStatus.ERROR if end == 'error' else DiagnosticStatus.OK
        for publisher in self._states_out:
            publisher.publish(status('simulator', state, values, level))

    def _report(self) -> None:
        kept, newest = self._punctuality, self._lockstep.barrier.newest
        gaits = [newest[gait] for gait in self._sources.gaits if gait in newest]
        age = max([(self.now_ns - gait.stamp_ns) / 1e9 for gait in gaits], default=0.0)
        trouble = kept.late or kept.stale or age > self.parameters.command_timeout
        self.report(
            DiagnosticStatus.WARN if trouble else DiagnosticStatus.OK,
            self.state,
            {
                'sync': self.parameters.sync,
                'waiting_for': ', '.join(self._absent),
                'reference_age_s': f'{age:.3f}' if gaits else '',
                'missed_periods': str(kept.late),
                'stale_corrections': str(kept.stale),
                **self._latency.figures(),
            },
        )
