"""Driver of the real robot, with the ramp, limits and watchdogs that protect its servos.

States: ``disconnected``, ``idle`` (torque off), ``ramping`` to the first reference, ``running``,
``holding`` the last target, and ``fault``, which only :meth:`BoardDriver.free` leaves.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from math import radians

from khr_common.errors import KhrError
from khr_common.interfaces import JOINTS, mix
from khr_common.published import NO_LOAD_SPEED
from khr_hardware.battery import Battery
from khr_hardware.client import Client
from khr_hardware.errors import BoardError
from khr_hardware.feedback import Feedback
from khr_hardware.gyro import RestingGyro
from khr_hardware.inspection import Inspection, inspect, silence
from khr_hardware.joint_map import JointMap
from khr_hardware.parameters import BoardParameters
from khr_hardware.protocol.memory import HIGHEST, LOWEST, Config
from khr_hardware.ramp import Ramp

MAX_FAILED_WRITES, MAX_FAILED_READS = 3, 10  # consecutive failures that lead to fault
FREE_ATTEMPTS = 10  # on a silent board they take about a second
START_MARGIN = radians(5.0)  # beyond its limits, accepted for a joint at the start
CONFIG_CHECK_PERIODS = 5  # control periods between two reads of the configuration
LOW_BATTERY_TIME = 0.5  # s for which a low battery is accepted
TORQUE_STATES = ('ramping', 'running', 'holding')  # states in which the servos have torque


class BoardDriver:
    """Drive the robot behind a board, one control period at a time.

    Args:
        client: of the board.
        joint_map: of the robot.
        parameters: may change at any time.
        clock: of the limits in time, s; periods may come late.

    Attributes:
        state: see the module.
        reason: of the state ``fault``; empty otherwise.
        pose: last measured joint angles, rad; the targets while the servos have torque and no
            position is read.
        ad: AD readings of the last period minus their references, steps.
        starved: whether the driver holds because no reference is recent enough.
        gyro: None without a gyro.
        feedback: the loop closed on the board; None if the computer closes it.

    Raises:
        KhrError: if the board is to close the loop, and the map has no gyro.
    """

    def __init__(
        self,
        client: Client,
        joint_map: JointMap,
        parameters: BoardParameters,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.parameters = parameters
        self._clock = clock
        self.client = client
        self.map = joint_map
        self.state, self.reason = 'disconnected', ''
        self.pose = [0.0] * len(JOINTS)
        self.ad: Sequence[int] = ()
        self.starved = False
        self.feedback = Feedback(client, joint_map) if parameters.mixing == 'board' else None
        own = RestingGyro(joint_map.gyro) if joint_map.gyro else None
        self.gyro = self.feedback.gyro if self.feedback else own
        self._trims: dict[int, int] = {}
        self._battery = Battery(clock)
        self._config = Config(0)
        self._checked = self._turn = 0
        self._target = list(self.pose)
        self._ramp: Ramp | None = None  # of the last start
        self._torque_since = 0.0
        self._failed_writes = self._failed_reads = 0

    def connect(self) -> Inspection:
        """Read the board and stop its ROM program and mixings; trims are not changed.

        The LED is switched off, by which a restart shows even if the board's own configuration is
        otherwise the driver's.

        Raises:
            BoardError: if the board or a servo of the map does not answer.
            KhrError: if a trim differs from the map; then nothing is written.
        """
        seen = inspect(self.client, self.map)
        self.pose = seen.pose(self.map)
        seen.check_trims(self.map)
        self._trims = {ics: record.trim for ics, record in seen.records.items()}
        self._battery.reference = seen.references[0]
        if self.gyro:
            self.gyro.connect(seen.references)
        config = seen.config.quiet().with_cycle(self.parameters.control_period).without_led()
        silence(self.client, seen, config)
        self._config = config
        self._update_sensors(seen.ad)
        self.state = 'idle'
        return seen

    def start(self) -> None:
        """Switch the torque on at the measured pose and start the ramp to the reference.

        Raises:
            KhrError: if the state is not idle or holding, the battery is low, a joint is outside
                its limits, or the gyro shows that the robot moves.
            BoardError: if the pose cannot be read or written.
        """
        if self.state not in ('idle', 'holding'):
            raise KhrError(f'start: not while {self.state}; accepted: idle or holding')
        if self.battery < self.parameters.battery_stop:
            raise KhrError(
                f'battery: {self.battery:.2f} V is not accepted; accepted: above '
                f'{self.parameters.battery_stop:g} V'
            )
        idle = self.state == 'idle'
        if idle:
            self._take_pose()
        if self.feedback:
            self.feedback.set_reference(self.parameters.ad_offset)
        if idle:
            self._switch_on()
        self._failed_writes = self._failed_reads = 0
        self._begin_ramp()

    def ramp_again(self) -> None:
        """Ramp from the last target to a reference that has jumped; a raised loop stays raised."""
        if self.state == 'running':
            self._begin_ramp()

    def hold(self) -> None:
        """Hold the last target.

        Raises:
            KhrError: if the servos have no torque.
            BoardError: if the board's loop could not be removed; the state is then ``fault``.
        """
        if self.state not in TORQUE_STATES:
            raise KhrError(f'hold: not while {self.state}; accepted: {" | ".join(TORQUE_STATES)}')
        self.state = 'holding'
        self._end_feedback()
        if self.state != 'holding':
            raise BoardError(self.reason)

    def free(self) -> None:
        """Switch the torque off in any state.

        Raises:
            BoardError: if the board does not acknowledge; only the battery switch helps then.
        """
        for left in reversed(range(FREE_ATTEMPTS)):
            try:
                self.client.free(self.map.numbers)
                break
            except BoardError as error:
                if not left or self.client.closed:
                    self._fail(f'the servos could not be freed: {error}')
                    raise
        self.state, self.reason = 'idle', ''
        self._end_feedback()

    def leave(self) -> None:
        """Free or hold the servos at the end, as ``at_exit`` selects.

        Raises:
            BoardError: as :meth:`free`, or if a mixing of the board's loop stays.
        """
        if self.state == 'disconnected' or self.client.closed:
            return
        self._end_feedback()
        if self.parameters.at_exit == 'free':
            self.free()
        elif self.state in TORQUE_STATES:
            self.state = 'holding'
        if self.feedback and self.feedback.mixed:
            raise BoardError(
                f'the feedback of {", ".join(self.feedback.mixed)} stays on the board'
            )

    @property
    def battery(self) -> float:
        """Return the voltage of the battery, V."""
        return self._battery.voltage

    @property
    def pitch_rate(self) -> float:
        """Return the reading of the gyro, rad/s; 0 without one."""
        return self.gyro.pitch_rate if self.gyro else 0.0

    # ---- a period ----

    def step(
        self, reference: Sequence[float] | None, corrections: Sequence[Mapping[str, float]] = ()
    ) -> None:
        """Write the target of a control period; repeated failures lead to ``fault``.

        Args:
            reference: 17 joint angles, rad; None if no reference is recent enough: the robot
                holds and continues with the next reference.
            corrections: angles by joint that are added to the reference while running, rad.
        """
        if self.state not in TORQUE_STATES or self.client.closed:
            return
        if self._clock() - self._torque_since > self.parameters.torque_time:
            self._stop_at_limit(f'{self.parameters.torque_time:g} s with torque')
            return
        self.starved = reference is None
        goal = list(self._target)
        if reference is not None and self.state == 'ramping':
            goal = self._ramped(reference)
        elif reference is not None and self.state == 'running':
            goal = mix(reference, corrections)
            self._raise_feedback()
        most = NO_LOAD_SPEED * self.parameters.control_period
        self._target = [
            servo.step_towards(aim, last, most)
            for servo, aim, last in zip(self.map.servos.values(), goal, self._target, strict=True)
        ]
        try:
            self._move()
        except BoardError as error:
            self._failed_writes += 1
            if self._failed_writes >= MAX_FAILED_WRITES or self.client.closed:
                self._fail(f'{self._failed_writes} writes failed: {error}')
        else:
            self._failed_writes = 0

    def measure(self) -> None:
        """Read the AD ports and some positions; repeated failures lead to ``fault``."""
        if self.state == 'disconnected' or self.client.closed:
            return
        tried = self.client.counts.retries
        try:
            self._update_sensors(self.client.ad())
            for _ in range(self.parameters.positions_per_period):
                if self.client.counts.retries > tried:
                    break  # on a bad line, free must not wait for further reads
                joint, servo = list(self.map.servos.items())[self._turn]
                self.pose[JOINTS.index(joint)] = servo.angle(self.client.measured(servo.ics))
                self._turn = (self._turn + 1) % len(JOINTS)
            if self._moves_unread:
                self.pose = list(self._target)
            self._checked += 1
            changed = (
                self._checked % CONFIG_CHECK_PERIODS == 0 and self.client.config() != self._config
            )
        except BoardError as error:
            self._failed_reads += 1
            if self._failed_reads >= MAX_FAILED_READS or self.client.closed:
                self._fail(f'{self._failed_reads} reads failed: {error}')
            return
        self._failed_reads = 0
        if changed:
            self._fail('the board has restarted, or another program has configured it')
        elif self.state in TORQUE_STATES and self._battery.low_for > LOW_BATTERY_TIME:
            self._stop_at_limit(f'battery at {self.battery:.2f} V')

    def _take_pose(self) -> None:
        """Take the pose and the gyro's level at rest as the beginning of a start."""
        seen = inspect(self.client, self.map)
        pose = seen.pose(self.map)
        outside = self.map.outside(pose, START_MARGIN)
        if outside:
            raise KhrError(outside[0])
        if self.gyro:
            self.gyro.take_level(seen.references)
        self.pose, self._target = pose, list(pose)

    def _switch_on(self) -> None:
        """Switch the torque on at the pose."""
        self._torque_since = self._clock()
        try:
            self._move()
        except BoardError:
            self.free()  # the board may have received the move nevertheless
            raise

    def _begin_ramp(self) -> None:
        self._ramp = Ramp(self._target, radians(self.parameters.ramp_speed_deg_s))
        self.state = 'ramping'

    def _ramped(self, reference: Sequence[float]) -> list[float]:
        """Return the next target on the ramp; after it the robot runs once its loop is raised."""
        assert self._ramp is not None
        target = self._ramp.advance(reference, self.parameters.control_period)
        if target is None and self._raise_feedback():
            self.state = 'running'
        return list(reference) if target is None else target

    def _raise_feedback(self) -> bool:
        """Raise the ratios of the board's loop; return whether they have reached their targets."""
        own = self.parameters
        if self.feedback is None or own.dry_run:
            return True
        try:
            return self.feedback.raise_to(own.ankle_ratio, own.hip_ratio, own.control_period)
        except BoardError as error:
            self._fail(f'the feedback could not be written: {error}')
            return False

    def _end_feedback(self) -> None:
        """Set the ratios of the board's loop to 0."""
        if self.feedback is None:
            return
        try:
            self.feedback.end()
        except BoardError as error:
            self._fail(f'the feedback could not be removed: {error}')

    def _move(self) -> None:
        if self.parameters.dry_run:
            return
        positions = self.map.positions(self._target)
        for ics, position in positions.items():
            trim = self._trims[ics]
            positions[ics] = min(max(position + trim, LOWEST), HIGHEST) - trim
        self.client.move(positions)

    def _update_sensors(self, ad: Sequence[int]) -> None:
        self.ad = ad
        self._battery.update(ad[0], self.parameters.battery_stop)
        if self.gyro:
            self.gyro.update(ad, self.state == 'idle')

    @property
    def _moves_unread(self) -> bool:
        """Return whether the servos follow the targets and no position is read."""
        own = self.parameters
        return self.state in TORQUE_STATES and not (own.positions_per_period or own.dry_run)

    def _stop_at_limit(self, reason: str) -> None:
        """Free or hold the servos after a limit is exceeded, and enter ``fault``."""
        try:
            self.leave()
        except BoardError:
            return
        self._fail(reason)

    def _fail(self, reason: str) -> None:
        self.state = 'fault'
        self.reason = self.reason or reason
