"""The simulator node: it stands for the hardware, and it owns time."""

from __future__ import annotations

import time
from functools import partial

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rclpy.clock import Clock, ClockType
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from khr_common import KhrError, ParameterError
from khr_common.block import NodeSpec
from khr_common.interfaces import (
    JOINT_REFERENCE,
    JOINTS,
    OVER,
    PUSH,
    PUSHED,
    READY,
    STATE,
    correction,
)
from khr_common.nodes.messages import restamp, status
from khr_common.nodes.node import KhrNode
from khr_common.run_identity import KEY, MalformedError, read_ready
from khr_sim.lockstep import Barrier, Receipts
from khr_sim.nodes.inputs import Answer, read_answer, read_push
from khr_sim.nodes.metronome import Metronome
from khr_sim.nodes.truth_publisher import TruthPublisher
from khr_sim.plant import Plant, mix
from khr_sim.punctuality import Latency, Punctuality
from khr_sim.run_parameters import GAIT, RunParameters

ASK_AGAIN = 0.1  # s of wall time without an answer
LEAD = 3_000_000_000  # ns of simulated time that lockstep may be ahead of a listener
SILENCE = 4.0  # s of wall time without a report of those that have not received the end
REPORT_PERIOD = 1.0  # s of wall time between diagnostics


class SimulatorNode(KhrNode):
    """Publish the truth of each control period, take the answers, step the physics.

    States: ``waiting`` (for the first reference, the first answers and the listeners),
    ``running``, ``paused``, ``finished``, and ``resetting`` until the listeners have received all
    of a run that another is to follow.
    """

    parameters: RunParameters
    patience = 20.0

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self.plant = Plant(self.parameters)
        self._period_ns = round(self.parameters.control_period * 1e9)
        self._output = TruthPublisher(self, self.plant.world.robot.urdf)
        self._state_out = self.publisher(STATE)
        self._receipts = Receipts(self.parameters.listeners)
        self._latency = Latency()
        self._sources = [name for name in self.parameters.answers if name]
        for source in self._sources:
            topic = JOINT_REFERENCE if source == GAIT else correction(source, ())
            self.subscribe_bytes(topic, read_answer, partial(self._on_answer, source))
        self.subscribe(READY, self._on_ready)
        self._pushes_out = self.publisher(PUSHED)
        self.subscribe(PUSH, self._on_push)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_service(SetBool, '~/pause', self._on_pause)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(ASK_AGAIN, self._on_watch, clock=self._steady)
        on_tick = self._pump if self._lockstep else self._on_tick
        self._metronome = Metronome(self, self._steady, on_tick)
        self._restart()
        self._metronome.configure(self.parameters)

    @property
    def _lockstep(self) -> bool:
        return self.parameters.sync == 'lockstep'

    def configure(self, parameters: RunParameters) -> None:
        """Pass changed parameters to the physics; they act from the next control period."""
        self.plant.configure(parameters)
        self._metronome.configure(parameters)

    def check_next(self, parameters: RunParameters) -> None:
        """Refuse what is settled when the node starts."""
        for name in ('answers', 'listeners', 'sync'):
            if getattr(parameters, name) != getattr(self.parameters, name):
                raise ParameterError(f'{name}: cannot change while the graph runs')

    def finish(self) -> None:
        """Publish how far the run got."""
        self._attention = time.monotonic()
        if self.state != 'finished':
            self._enter('finished', end='stopped')

    def settled(self) -> bool:
        """Return whether the listeners have received all; what they miss comes from here alone."""
        waited = time.monotonic() - self._attention
        return (
            self.failure is not None or not self._receipts.behind(self.now_ns) or waited > SILENCE
        )

    def close(self) -> None:
        """Release the physics."""
        self.plant.close()

    # ---- the course of a run ----

    def _restart(self) -> None:
        if self.begin():
            self.plant.close()
            self.plant = Plant(self.parameters)
            self._period_ns = round(self.parameters.control_period * 1e9)
            self._metronome.configure(self.parameters)
        self._barrier: Barrier[Answer] = Barrier(self._sources)
        self._barrier.open(0)
        self.now_ns = 0
        self._receipts.begin()
        self._started = False
        self._progress = self._attention = self._born = self._reported = time.monotonic()
        self._punctuality = Punctuality()
        self._metronome.restart()
        self._enter('waiting')
        self._output.describe()
        if GAIT not in self._sources:
            self._begin([0.0] * len(JOINTS))
        else:
            self._output.tick(0)

    def _begin(self, posture: list[float]) -> None:
        self._held = posture
        self._started = True
        self._output.publish(self.plant.start(posture))

    def _pump(self) -> None:
        """Go as far as the answers allow."""
        if not self._started:
            reference = self._barrier.at(0).get(GAIT)
            if reference is None:
                return
            self._begin(list(reference.position))
        if self.state == 'waiting' and not self._waiting_for():
            self._enter('running')
        while (
            self.state == 'running'
            and self._lockstep
            and not self._missing()
            and self._metronome.begins()
        ):
            self._advance(self._barrier.at(self._due))

    @property
    def _due(self) -> int:
        """The instant whose answers act in the coming period."""
        return max(0, self.now_ns - self.parameters.control_delay * self._period_ns)

    def _missing(self) -> list[str]:
        """List whom the coming period waits for: answers, and listeners that are far behind."""
        return [*self._barrier.missing(self._due), *self._receipts.behind(self.now_ns - LEAD)]

    def _waiting_for(self) -> list[str]:
        return self._barrier.missing(0) + self._receipts.absent()

    def _advance(self, answers: dict[str, Answer]) -> None:
        # With a delay the first period has no answer yet: the board holds the first reference.
        held = self.now_ns == 0 and self.parameters.control_delay > 0
        if GAIT in answers:
            self._held = list(answers[GAIT].position)
        corrections = (
            []
            if held
            else [
                dict(zip(answers[source].name, answers[source].position, strict=True))
                for source in self._sources
                if source != GAIT and source in answers
            ]
        )
        try:
            truth = self.plant.advance(mix(self._held, corrections))
        except KhrError as error:
            self._abort(str(error))
            return
        self.now_ns = truth.stamp_ns
        self._barrier.open(self.now_ns)
        self._progress = time.monotonic()
        self._output.publish(truth)
        if self.plant.end:
            self._enter('finished', end=self.plant.end)

    # ---- what arrives ----

    def _on_answer(self, source: str, answer: Answer) -> None:
        if source == GAIT and tuple(answer.name) != JOINTS:
            raise MalformedError('not all joints in their order')
        if not self._barrier.put(source, answer.stamp_ns, answer):
            return
        if source != GAIT and answer.stamp_ns == self.now_ns:
            self._latency.add(time.monotonic() - self._progress)
        try:
            self._pump()
        except KhrError as error:
            self._abort(str(error))

    def _on_ready(self, message: String) -> None:
        name, stamp_ns = read_ready(message.data, self.run)
        if self._receipts.take(name, stamp_ns, self.now_ns):
            self._attention = time.monotonic()
            self._pump()

    def _on_push(self, message: WrenchStamped) -> None:
        try:
            push = read_push(message, self.parameters, self.now_ns)
            self.plant.world.push(push)
        except KhrError as error:
            raise MalformedError(str(error)) from error
        message.header.frame_id = push.frame
        restamp(message.header.stamp, round(push.start * 1e9))
        self._pushes_out.publish(message)  # who asks once may be unknown to a recorder

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._started:
            self._attention = time.monotonic()
            self._enter('resetting', end='reset')
        else:
            self._restart()
        response.success, response.message = True, 'a new run begins at time 0'
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        able = self.state in ('running', 'paused')
        if able:
            self._enter('paused' if request.data else 'running')
            self._punctuality.rest()
            self._progress = time.monotonic()
            self._pump()
        response.success, response.message = able, self.state
        return response

    # ---- wall time ----

    def _on_tick(self) -> None:
        """Advance one period in realtime mode, with whatever answers are fresh."""
        if self.state != 'running':
            return
        p = self.parameters
        self._punctuality.tick(time.monotonic(), p.control_period, p.realtime_factor)
        answers = self._barrier.newest()
        oldest = self.now_ns - round(p.command_timeout * 1e9)
        fresh = {
            source: answer
            for source, answer in answers.items()
            if source == GAIT or answer.stamp_ns >= oldest
        }
        self._punctuality.stale += len(answers) - len(fresh)
        self._advance(fresh)

    def _on_watch(self) -> None:
        """Ask again for what is missing, and give up on it after its time."""
        now = time.monotonic()
        silent = now - max(self._progress, self._attention)
        if self.state == 'waiting':
            self._wait(now)
        elif self.state == 'resetting':
            if silent > ASK_AGAIN and self.settled():
                self._restart()
        elif self.state == 'running' and self._lockstep and silent > ASK_AGAIN and self._missing():
            if silent > self.parameters.lockstep_timeout:
                self._abort(
                    f'{self._silence()} within {self.parameters.lockstep_timeout:g} s of wall time'
                )
            elif self._barrier.missing(self._due):
                self._output.repeat()
        if now - self._reported > REPORT_PERIOD:
            self._reported = now
            self._report()

    def _silence(self) -> str:
        """Say whom the run waits for."""
        silent = self._barrier.missing(self._due)
        if silent:
            return f'no answer from {", ".join(silent)} for t = {self._due / 1e9:.3f} s'
        return 'not received whole by ' + ', '.join(
            f'{name} after t = {up_to / 1e9:.3f} s'
            for name, up_to in self._receipts.behind(self.now_ns - LEAD).items()
        )

    def _wait(self, now: float) -> None:
        absent = self._waiting_for()
        limit = self.parameters.start_timeout
        if limit and now - self._born > limit:
            self._abort(f'{", ".join(absent)} did not appear within {limit:g} s')
        elif self._started:
            self._output.repeat()
        else:
            self._output.tick(0)
        if absent != self._absent:
            self._enter('waiting')

    def _abort(self, reason: str) -> None:
        """End the run with an error that watchers can read."""
        self.fail(reason)
        self._enter('finished', end='error', reason=reason)

    def _enter(self, state: str, end: str = '', reason: str = '') -> None:
        self.state = state
        self._absent = self._waiting_for() if state == 'waiting' else []
        values = {
            'time_ns': str(self.now_ns),
            'end': end,
            'reason': reason,
            'waiting_for': ', '.join(self._absent),
            KEY: self.run,
        }
        if state in OVER:
            values['trajectory_hash'] = self.plant.trajectory_hash if self._started else ''
            values |= {} if self._lockstep else self._punctuality.figures()
        self._state_out.publish(
            status(
                'simulator',
                state,
                values,
                DiagnosticStatus.ERROR if end == 'error' else DiagnosticStatus.OK,
            )
        )

    def _report(self) -> None:
        kept = self._punctuality
        self.report(
            DiagnosticStatus.WARN if kept.late or kept.stale else DiagnosticStatus.OK,
            self.state,
            {
                'sync': self.parameters.sync,
                'missed_periods': str(kept.late),
                'stale_corrections': str(kept.stale),
                **self._latency.figures(),
            },
        )
