"""The board node drives the real robot in place of the simulator, in wall time."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String
from std_srvs.srv import Trigger

from khr_common import KhrError, cdr
from khr_common.block import NodeSpec
from khr_common.errors import MalformedError
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    BOARD_CORRECTION,
    CLOCK,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    JOINT_REFERENCE,
    JOINT_STATES,
    JOINTS,
    REGIONS,
    ROBOT_DESCRIPTION,
    STATE,
    Topic,
    correction,
)
from khr_common.nodes.messages import JointAnswer, read_answer, status
from khr_common.nodes.node import KhrNode
from khr_common.pacing import Latency, Punctuality
from khr_common.processes import ask_for_real_time
from khr_common.statuses import KEY
from khr_hardware.client import connect
from khr_hardware.driver import BoardDriver
from khr_hardware.errors import BoardError
from khr_hardware.gyro import REST_SAMPLES
from khr_hardware.inspection import Inspection
from khr_hardware.joint_map import JointMap
from khr_hardware.parameters import BoardParameters
from khr_hardware.ramp import jumps

GAIT = 'gait'
ASK_AGAIN = 0.1  # s of wall time between requests for the first reference
REPORT_PERIOD = 1.0  # s of wall time


def read_joint_answer(data: bytes) -> JointAnswer:
    """Read an answer with joints of this robot.

    Raises:
        MalformedError: if the message is invalid.
    """
    answer = read_answer(data)
    if not set(answer.name) <= set(JOINTS):
        raise MalformedError('a joint that the robot does not have')
    return answer


class BoardNode(KhrNode):
    """Write a target and read the sensors in each control period.

    Until the service ``~/start`` is called the robot is free and the clock stays at 0. Then the
    servos hold their positions, ramp to the first reference, and the clock runs. ``~/hold`` and
    ``~/free`` take effect immediately. A fault ends the run with its reason. After the end of the
    run the robot is held under the same watchdogs, and does not start again.
    """

    parameters: BoardParameters
    keeps = True  # frees the robot also if its parent process is killed
    state: str  # of the run

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        own = self.parameters
        joint_map = JointMap.load(own.map)
        description = _text(own.urdf)
        client, rate = connect(own.port, own.baud, own.reply_timeout)
        self.driver = BoardDriver(client, joint_map, own)
        self._describe(self.driver.connect(), rate)
        if self.driver.gyro:
            for _ in range(REST_SAMPLES):  # start requires them
                time.sleep(own.control_period)
                self.driver.measure()
        self._period_ns = round(own.control_period * 1e9)
        self._answers: dict[str, JointAnswer] = {}
        brought = spec.brought(own)
        self._outputs = {topic: self.output(topic) for topic in brought if topic.flow == 'period'}
        self._state_out = self.publisher(STATE)
        if description:
            self.publisher(ROBOT_DESCRIPTION).publish(String(data=description))
        for source in filter(None, own.answers):
            topic = JOINT_REFERENCE if source == GAIT else correction(source, ())
            self.subscribe_bytes(topic, read_joint_answer, partial(self._on_answer, source))
        if self.driver.feedback:
            for topic in (ANKLE_CORRECTION, HIP_CORRECTION):
                self.subscribe_bytes(topic, cdr.clock, _reject_correction)
        actions = {'start': self._start, 'hold': self.driver.hold, 'free': self._free}
        for name, action in actions.items():
            self.create_service(Trigger, f'~/{name}', partial(self._on_service, action))
        self._punctuality = Punctuality()
        self._exchanges, self._latency, self._to_servo = Latency(), Latency(), Latency()
        self._read_at = self._published = self._asked = self._reported = float('-inf')
        self._recent: dict[int, float] = {}  # when the stamps within command_timeout were sent
        self._ramped_to: JointAnswer | None = None  # until the clock has brought another reference
        self._ramped_again = False
        self._real_time = ask_for_real_time(own.priority)
        self._enter('waiting')
        self.by_wall_clock(own.control_period, self._on_period)

    def configure(self, parameters: BoardParameters) -> None:
        """Pass changed parameters to the driver."""
        self.driver.parameters = parameters

    def finish(self) -> None:
        """Publish the final state of the run."""
        if self.state != 'finished':
            self._enter('finished', end='stopped')

    def close(self) -> None:
        """Free or hold the robot, as ``at_exit`` selects, and close the line."""
        try:
            self.driver.leave()
        except KhrError as error:
            self.fail(f'{error}; switch the battery off')
        self.driver.client.close()

    # ---- a period ----

    def _on_period(self) -> None:
        after = self.state == 'finished'
        if self.closed or (after and self.driver.state == 'idle'):
            return
        try:
            if after:
                self._watch()
            else:
                self._run_period(time.monotonic())
        except Exception:
            self.close()  # never leave the robot with torque and without a driver
            raise
        if self.driver.state == 'fault':
            if not after:
                self._enter('finished', end='error', reason=self.driver.reason)
            self.fail(self.driver.reason)

    def _watch(self) -> None:
        """Hold the last target after the end of the run; the watchdogs stay in force."""
        self.driver.step(None)
        self.driver.measure()

    def _run_period(self, now: float) -> None:
        own, driver = self.parameters, self.driver
        if self.state == 'running':
            self._punctuality.tick(now, own.control_period, 1.0)
        answered = self._answered
        self._check_first_reference()
        driver.step(*self._fresh_inputs(now))
        if answered:
            self._to_servo.add(time.monotonic() - self._read_at)
        if self.state == 'waiting' and driver.state == 'running':
            self._ramped_to = None if self._ramped_again else self._answers[GAIT]
            self._ramped_again = False
            self._enter('running')
        elif self.state == 'running':
            self.now_ns += self._period_ns
        driver.measure()
        self._read_at = time.monotonic()
        self._exchanges.add(self._read_at - now)
        if self.state == 'running':
            self._publish()
        elif now - self._asked > ASK_AGAIN:
            self._asked = now
            self._send(CLOCK)
        ended = own.duration and self.now_ns >= round(own.duration * 1e9)
        if ended and driver.state != 'fault':
            self._end()
        if now - self._reported > REPORT_PERIOD:
            self._reported = now
            self._report()

    def _check_first_reference(self) -> None:
        """Ramp, with the clock at rest, if its first new reference is far from the ramp's end.

        A gait answers each stamp once: one that was changed meanwhile shows only then.
        """
        known, newest = self._ramped_to, self._answers.get(GAIT)
        if not known or not newest or newest.stamp_ns <= known.stamp_ns:
            return
        self._ramped_to = None
        if self.state == 'running' and jumps(known.position, newest.position):
            self._ramped_again = True  # but once: a gait may begin fast
            self.driver.ramp_again()
            self.state = 'waiting'
            self._punctuality.rest()

    def _end(self) -> None:
        """Hold the robot at the end of the run; a fault of the driver ends it otherwise."""
        with suppress(BoardError):
            self.driver.hold()
            self._enter('finished', end='duration')

    @property
    def _answered(self) -> bool:
        """Return whether this period writes a correction for the newest sample."""
        return self.state == 'running' and any(
            source != GAIT and answer.stamp_ns == self.now_ns
            for source, answer in self._answers.items()
        )

    def _fresh_inputs(self, now: float) -> tuple[list[float] | None, list[dict[str, float]]]:
        """Return the newest reference and corrections that are within ``command_timeout``.

        Their age is of wall time, because late periods do not count. Before the clock runs there
        is only the reference for its start.
        """
        fresh = self._answers
        if self.state == 'running':
            oldest = now - self.parameters.command_timeout
            self._recent = {at: sent for at, sent in self._recent.items() if sent >= oldest}
            fresh = {
                source: answer
                for source, answer in self._answers.items()
                if answer.stamp_ns in self._recent
            }
            self._punctuality.stale += len(self._answers) - len(fresh)
        reference = fresh.get(GAIT)
        corrections = [
            dict(zip(fresh[source].name, fresh[source].position, strict=True))
            for source in self.parameters.answers
            if source != GAIT and source in fresh
        ]
        return (None if reference is None else list(reference.position)), corrections

    def _publish(self) -> None:
        driver, outputs = self.driver, self._outputs
        self._published = self._recent[self.now_ns] = time.monotonic()
        self._send(CLOCK)
        self._send(JOINT_STATES, *driver.pose)
        if GYRO in outputs:
            self._send(GYRO, 0.0, driver.pitch_rate, 0.0)
        forces = driver.map.normal_forces(driver.ad)
        for region, topic in zip(REGIONS, FOOT_FORCES, strict=True):
            if topic in outputs:
                self._send(topic, 0.0, 0.0, forces[region])
        if driver.feedback:
            self._send(BOARD_CORRECTION, *driver.feedback.correction(driver.ad))

    def _send(self, topic: Topic, *numbers: float) -> None:
        output = self._outputs[topic]
        output.fill(self.now_ns, numbers)
        output.send()

    # ---- received messages ----

    def _on_answer(self, source: str, answer: JointAnswer) -> None:
        if source == GAIT and answer.name != JOINTS:
            raise MalformedError('expected all joints in their order')
        if answer.stamp_ns > self.now_ns:
            raise MalformedError('a stamp in the future')
        known = self._answers.get(source)
        if known is None or answer.stamp_ns > known.stamp_ns:
            self._answers[source] = answer
            if source != GAIT and answer.stamp_ns == self.now_ns and self.state == 'running':
                self._latency.add(time.monotonic() - self._published)

    def _on_service(
        self, action: Callable[[], None], _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        try:
            action()
        except KhrError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, self.driver.state
        return response

    def _start(self) -> None:
        if self.state == 'finished':
            raise KhrError('start: not after the end of the run; accepted: a new run')
        self.driver.start()

    def _free(self) -> None:
        self.driver.free()
        if self.state == 'running':
            self._enter('finished', end='stopped', reason='set free')

    # ---- reports ----

    def _describe(self, seen: Inspection, rate: int) -> None:
        trims = {ics: record.trim for ics, record in seen.records.items()}
        self.get_logger().info(
            f'{self.parameters.port} at {rate} baud: {seen.version}, battery '
            f'{self.driver.battery:.2f} V, configuration {seen.config.word:#06x}, trims {trims}'
        )

    def _enter(self, state: str, end: str = '', reason: str = '') -> None:
        self.state = state
        values = {
            'time_ns': str(self.now_ns),
            'end': end,
            'reason': reason,
            'waiting_for': 'khr board start' if state == 'waiting' else '',
            KEY: self.run,
        }
        if state == 'finished':
            values |= {'trajectory_hash': '', **self._punctuality.result().texts()}
        level = DiagnosticStatus.ERROR if end == 'error' else DiagnosticStatus.OK
        self._state_out.publish(status('board', state, values, level))

    def _report(self) -> None:
        driver = self.driver
        low = driver.battery < self.parameters.battery_warn
        worried = low or driver.starved or driver.state == 'fault'
        self.report(
            DiagnosticStatus.WARN if worried else DiagnosticStatus.OK,
            driver.state,
            {
                'sync': self.parameters.sync,
                'real_time_priority': 'granted' if self._real_time else 'none',
                'battery_v': f'{driver.battery:.2f}',
                'joint_states': 'measured' if self.parameters.positions_per_period else 'targets',
                'holds_for_want_of_a_reference': str(driver.starved).lower(),
                'missed_periods': str(self._punctuality.late),
                'stale_corrections': str(self._punctuality.stale),
                **self._exchanges.figures('exchange'),
                **self._latency.figures(),
                **self._to_servo.figures('sensor_to_servo'),
                **driver.client.counts.figures(),
            },
        )


def _reject_correction(_: int) -> None:
    """Reject a correction while the board closes the loop: it would be closed twice."""
    raise MalformedError('the board closes the loop by its mixing')


def _text(path: str) -> str:
    """Return the text of a file; empty without a path."""
    try:
        return Path(path).read_text(encoding='utf-8') if path else ''
    except (OSError, UnicodeDecodeError) as error:
        raise KhrError(f'urdf: {path}: {error}; accepted: a file that can be read') from error
