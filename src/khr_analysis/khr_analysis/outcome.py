"""Outcome of a run: whether the robot fell, slipped, walked or stood, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, degrees, hypot, inf, isfinite, radians
from typing import Literal, NamedTuple

from khr_analysis.outcome_measures import Slides, SoleSlip, StepSlides, Vibration
from khr_common import KhrError, fixed, parameter, sample_period
from khr_common.block import NodeSpec, Signals
from khr_common.interfaces import (
    DIAGNOSTICS,
    FOOT_FORCES,
    GYRO,
    OUTCOME,
    PEAKS,
    READY,
    STATE,
    TRUE_FORCES,
    TRUE_POSE,
    TRUE_RATE,
    TRUE_SOLES,
)
from khr_common.rotation import Vector, dot, matrix, pitch_of

Verdict = Literal['walked', 'stood', 'slipped', 'fell']
SensedVerdict = Literal['fell', 'upright']
RIDES = 0.056  # m, the length of a step: a robot that slides further at once slides down the slope
OBSERVED = (TRUE_POSE, TRUE_RATE, TRUE_SOLES, *TRUE_FORCES)  # inputs of the monitor
SENSED = (GYRO, *FOOT_FORCES)  # inputs without a ground truth


@dataclass(frozen=True)
class MonitorParameters:
    """The parameter table of the monitor."""

    fall_tilt_deg: float = parameter(
        45.0,
        'Angle between torso and vertical from which on the robot has fallen if it stays down.',
        '[5, 90] deg',
    )
    fall_height: float = parameter(
        0.5,
        'Height of the torso above the lower sole, over that at the start, below which the '
        'robot has fallen.',
        '[0, 1]',
    )
    walk_distance: float = parameter(
        0.1, 'Way along the surface from which on the robot has walked.', '[0.001, 10] m'
    )
    step_slip: float = parameter(
        0.014,
        'Slide of one sole in one ground contact, by its share of the load, from which on the '
        'robot has slipped; the default is a quarter of its step of 56 mm.',
        '[0.0001, 1] m',
    )
    load_threshold: float = parameter(
        1.0, 'Normal force on a sole from which on it is loaded.', '[0, 100] N'
    )
    vibration_frequency: float = fixed(
        4.0,
        'Corner of the high-pass (Butterworth, order 16) behind which the pitch rate is vibration.',
        '[0.1, 15] Hz',
    )
    motion_end: float = fixed(
        0.0,
        'End of the motion with its end pause, after which vibration is not averaged; 0 averages '
        'over the whole run. khr makes it the end of a walk or leg lift unless the scenario states '
        'it.',
        '[0, 1e+06] s',
    )
    judge_by: str = fixed(
        'truth',
        'What to judge by: the truth of a simulator, or what the sensors read, which shows only '
        'whether the robot fell (khr: what the driver publishes).',
        choices=('truth', 'sensors'),
    )
    fall_rate_deg: float = parameter(
        150.0,
        'By the sensors: rate about any axis from which on the robot may be falling.',
        '[10, 2000] deg/s',
    )
    fall_memory: float = parameter(
        2.0,
        'By the sensors: time from such a rate to the loss of the load; the force sensors lag.',
        '[0, 10] s',
    )
    fall_time: float = parameter(
        0.3,
        'Time that the robot must stay down; a robot that rises sooner has not fallen. By the '
        'sensors: time without load.',
        '[0, 10] s',
    )
    control_period: float = sample_period(maximum=0.03)


def vibration_of(parameters: MonitorParameters) -> Vibration:
    """Return the measure of the vibration, before the first sample."""
    return Vibration(
        parameters.vibration_frequency, parameters.control_period, parameters.motion_end or inf
    )


class Outcome(NamedTuple):
    """Outcome of the run so far; after a fall it does not change, unless the robot rises soon.

    Attributes:
        verdict: ``fell`` outranks ``slipped``, which outranks ``walked`` and ``stood``; a robot
            that only slid down the slope has therefore not walked.
        time: of the last sample, s.
        fell_at: time of the fall, s.
        distance: of the torso along the surface, in the direction the left sole pointed at the
            start, m; negative if backward.
        lateral_drift: of the torso across that direction, to the left, m.
        largest_pitch: largest lean of the torso from the vertical, forward or backward in its own
            heading, rad.
        slip_distance: net slip of the loaded soles, over both feet and all steps, m. It falls
            while a sole slides back, so it may end below ``largest_slip``. A sole counts by its
            share of the load, so a robot that slides on both feet has slid as far as they did, and
            a foot dragged along before it lifts off counts next to nothing.
        largest_slip: largest slip of one sole in one ground contact, by its share of the load, m.
        vibration: root mean square of the pitch rate above the corner frequency until the end of
            the motion, rad/s.
        slides: per step of a walk, and in the stance before and after it.
    """

    verdict: Verdict
    time: float
    fell_at: float | None
    distance: float
    lateral_drift: float
    largest_pitch: float
    slip_distance: float
    largest_slip: float
    vibration: float
    slides: Slides = Slides()

    @property
    def fell(self) -> bool:
        """Return whether the robot has fallen."""
        return self.verdict == 'fell'

    @property
    def stayed_up(self) -> bool:
        """Return whether the robot neither fell nor slid down the slope on its soles.

        It slides down if one sole slides by a step, or both together do so in the last stance.
        """
        return not self.fell and max(self.largest_slip, self.slides.last) <= RIDES

    @property
    def largest_pitch_deg(self) -> float:
        """Return the largest pitch in deg."""
        return degrees(self.largest_pitch)

    @property
    def vibration_deg_s(self) -> float:
        """Return the vibration in deg/s."""
        return degrees(self.vibration)

    def lasted(self, whole: float) -> float:
        """Return the share of a run, ``whole`` s long, before the fall; 1 without a fall."""
        return 1.0 if self.fell_at is None else min(self.fell_at / whole, 1.0)


class SensedOutcome(NamedTuple):
    """Outcome of the run so far, by the sensors alone."""

    verdict: SensedVerdict  # fell, or upright: neither forces nor rate show a fall
    time: float  # since the first sample, s
    fell_at: float | None  # time of the fall, s
    fastest: float  # largest rate, about any axis, rad/s
    vibration: float  # as of an Outcome, of the rate that the board reads, rad/s


class OutcomeMonitor:
    """Judge a run while it goes on, in constant memory."""

    def __init__(self, parameters: MonitorParameters) -> None:
        self.configure(parameters)
        self._soles = (SoleSlip(), SoleSlip())
        self._start: _Start | None = None
        self._largest_pitch = 0.0
        self._vibration = vibration_of(parameters)
        self._steps = StepSlides(parameters.control_period)
        self._fall: Outcome | None = None  # the outcome when the robot went down

    def configure(self, parameters: MonitorParameters) -> None:
        """Use changed thresholds from the next sample on."""
        self.parameters = parameters

    def update(self, stamp_ns: int, signals: Signals) -> Outcome:
        """Take one sample per control period; return the outcome so far.

        Args:
            stamp_ns: of the sample, ns.
            signals: of OBSERVED at least, plain numbers.

        Raises:
            KhrError: if position, orientation or rate are not finite.
        """
        time, fall = stamp_ns / 1e9, self._fall
        if fall is not None and time > fall.time + self.parameters.fall_time:
            return fall
        x, y, z, *turn = signals[TRUE_POSE]
        place, feet = (x, y, z), signals[TRUE_SOLES]
        soles, turns = (feet[:3], feet[7:10]), (feet[3:7], feet[10:])
        up, rate = _up(turn), signals[TRUE_RATE][1]
        height = place[2] - min(sole[2] for sole in soles)
        if not all(map(isfinite, (*up, height, rate))):
            raise KhrError(
                f'observation: orientation {turn}, height {height} m, '
                f'pitch rate {rate} rad/s are not accepted; accepted: finite'
            )
        if self._start is None:
            self._start = _Start(place, height, *matrix(turns[0]).T.tolist()[:2])
        self._largest_pitch = max(self._largest_pitch, abs(pitch_of(*turn)))
        self._vibration.add(time, rate)
        normal = [signals[topic][2] for topic in TRUE_FORCES]
        forces = [normal[0] + normal[1], normal[2] + normal[3]]
        loaded = [force > self.parameters.load_threshold for force in forces]
        left, right = (
            sole.follow(soles[i], _up(turns[i]), forces[i] / sum(forces) if loaded[i] else 0.0)
            for i, sole in enumerate(self._soles)
        )
        self._steps.follow((left, right), loaded)
        outcome = self._judge(time, place, self._start, up[2], height)
        self._fall = (fall or outcome) if outcome.fell else None
        return self._fall or outcome

    def _judge(
        self, time: float, place: Vector, start: _Start, upright: float, height: float
    ) -> Outcome:
        own = self.parameters
        fallen = (
            upright < cos(radians(own.fall_tilt_deg)) or height < own.fall_height * start.height
        )
        forward, leftward = (
            dot(place, axis) - dot(start.position, axis) for axis in (start.ahead, start.left)
        )
        slip = max(sole.largest for sole in self._soles)
        verdict: Verdict = (
            'fell'
            if fallen
            else 'slipped'
            if slip > own.step_slip
            else 'walked'
            if abs(forward) > own.walk_distance
            else 'stood'
        )
        return Outcome(
            verdict,
            time,
            time if fallen else None,
            forward,
            leftward,
            self._largest_pitch,
            sum(sole.slip for sole in self._soles),
            slip,
            self._vibration.rms,
            slides=self._steps.slides,
        )


class SensedMonitor:
    """Judge a run by the gyro and the foot forces.

    A fall is a fast rotation followed by a loss of the load on both feet. A robot that is lifted
    by hand loses the load without a fast rotation; one that stumbles regains the load.
    """

    def __init__(self, parameters: MonitorParameters) -> None:
        self.configure(parameters)
        self._turned = float('-inf')  # when it last turned fast, s
        self._loaded = 0.0  # when a foot last carried the robot, s
        self._fell: float | None = None
        self._fastest = 0.0
        self._vibration = vibration_of(parameters)

    def configure(self, parameters: MonitorParameters) -> None:
        """Take changed parameters."""
        self.parameters = parameters

    def update(self, stamp_ns: int, signals: Signals) -> SensedOutcome:
        """Return the outcome so far.

        Args:
            stamp_ns: of the sample, in the time of the run.
            signals: of ``SENSED``.
        """
        own = self.parameters
        time = stamp_ns / 1e9
        rate = hypot(*signals[GYRO])
        self._fastest = max(self._fastest, rate)
        self._vibration.add(time, signals[GYRO][1])
        if rate > radians(own.fall_rate_deg):
            self._turned = time
        if sum(signals[topic][2] for topic in FOOT_FORCES) > own.load_threshold:
            self._loaded = time
        # The sensors lag: the forces go while it turns, or after.
        if (
            self._fell is None
            and time - self._loaded >= own.fall_time
            and self._turned >= self._loaded - own.fall_memory
        ):
            self._fell = time
        return SensedOutcome(
            'fell' if self._fell is not None else 'upright',
            time,
            self._fell,
            self._fastest,
            self._vibration.rms,
        )


MONITOR = NodeSpec(
    'monitor',
    'khr_analysis',
    MonitorParameters,
    subscribes=(*OBSERVED, *SENSED, PEAKS, STATE),
    publishes=(OUTCOME, DIAGNOSTICS, READY),
    node='khr_analysis.nodes.monitor:MonitorNode',
    listens=True,
)


@dataclass(frozen=True, eq=False)
class _Start:
    """Start of a run: torso, its height over the lower sole, two axes of the surface."""

    position: Vector
    height: float
    ahead: Vector
    left: Vector


def _up(quaternion: Sequence[float]) -> Vector:
    """Return the z axis of a frame."""
    x, y, z, w = quaternion
    return 2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)
