"""Push the standing robot as in chapter 4, and find the largest push that it survives.

The robot stands on level ground on rubber soles. A horizontal force acts on the torso for a given
time, at the centre of mass of the whole robot in its stance. The ankle loop has the gyro,
converter, board, delay and servos of a scenario. The monitor decides whether the robot falls.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from khr_balance.controllers import AnkleController, AnkleControllerParameters
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import Scenario
from khr_common.checks import non_negative, one_of, within
from khr_common.interfaces import ANKLE_CORRECTION, GYRO, mix
from khr_common.limit import bracket_limit
from khr_common.rotation import matrix
from khr_description.robot import Robot
from khr_models.checks import Array
from khr_models.gyro_circuit.circuit import KRG4
from khr_models.pendulum import Pendulum
from khr_models.standing.capture_point import capture_force
from khr_models.standing.push import DIRECTIONS, Direction
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.contact import corners
from khr_sim.physics.truth import GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import Changes

START = 2.1  # s, start of the push: the robot is at rest, leant by its whole correction
SOURCES = {'behind': 'behind', 'front': 'the front'}  # of a push, in words
ZERO_RATE = {GYRO: (0.0, 0.0, 0.0)}
WATCH = 2.5  # s, simulated after the push
TOLERANCE = 0.015  # of the ratio of fatal to survived force
LEAST = 0.05  # N; a smaller limit is reported as 0
COMPLIANT = ('l_ankle_pitch', 'l_knee', 'l_hip_pitch')
# The packaged gyro is the default of every scenario, with a fitted bandwidth; the circuit has its
# documented bandwidth of 50 Hz.
GYROS: dict[str, dict[tuple[str, str], object]] = {
    'packaged': {('gyro', 'model'): 'packaged'},
    'circuit': {('gyro', 'model'): 'circuit', ('gyro', 'bandwidth'): KRG4.bandwidth},
}


@dataclass(frozen=True)
class PushCondition:
    """The loop, and the duration and direction of a push."""

    gain: float = 0.0  # K_A as a setting of the board; 0 is no control
    duration: float = 0.1  # of the push, s
    direction: Direction = 'behind'  # of its origin; a push from behind acts forward
    gyro: str = 'packaged'  # one of GYROS
    changes: Changes = ()  # further parameters by (node, key)

    def __post_init__(self) -> None:
        one_of('direction', self.direction, DIRECTIONS)
        one_of('gyro', self.gyro, tuple(GYROS))
        within('duration', self.duration, 0.001, 60.0)
        self.base()

    @property
    def side(self) -> float:
        """Return the sign of the force along x."""
        return 1.0 if self.direction == 'behind' else -1.0

    def base(self) -> Scenario:
        """Return the scenario without a push."""
        changes: dict[tuple[str, str], object] = {
            ('simulator', 'surface'): 'rubber',
            ('simulator', 'duration'): START + self.duration + WATCH,
            ('simulator', 'stop_when_tilted_deg'): 50.0,  # a robot at this angle has fallen
            ('gait', 'motion'): 'stand',
            ('ankle_controller', 'enabled'): self.gain > 0.0,
            ('ankle_controller', 'gain'): float(self.gain),
            ('hip_controller', 'enabled'): False,
        }
        return Scenario('push', {}).changed(changes | GYROS[self.gyro] | dict(self.changes))

    def scenario(
        self, force: float, start: float = START, angle: float = 0.0, watch: float = WATCH
    ) -> Scenario:
        """Return the scenario of a push with a force of at least 0, N, from ``start``, s, on.

        The force is turned to the left by an angle, deg; the run ends ``watch``, s, after the push.
        """
        non_negative('force', force)
        base = self.base()
        if not force:
            return base
        along, turned = self.side * float(force), math.radians(angle)
        x, y = along * math.cos(turned), along * math.sin(turned) if angle else 0
        point = ','.join(f'{value:.6f}' for value in stance(base).point)
        return base.changed(
            {
                ('simulator', 'duration'): start + self.duration + watch,
                ('simulator', 'pushes'): [
                    f't={start!r} duration={self.duration:g} link=base_link frame=odom '
                    f'force={x!r},{y!r},0 point={point}'
                ],
            }
        )


@dataclass(frozen=True)
class Stance:
    """The robot's stance with loaded servos."""

    point: tuple[float, ...]  # the centre of mass in base_link, m, (3,)
    # with the robot's mass, its height over the soles and the length of their contact
    pendulum: Pendulum
    ahead: float  # distance of the centre of mass ahead of the foot's middle, m
    levers: tuple[float, ...]  # height of the centre of mass above the axes of COMPLIANT, m
    inertia: float  # of the robot about its centre of mass, in pitch, kg m^2

    def tipping(self, direction: Direction) -> tuple[Pendulum, float]:
        """Return the pendulum about its tipping edge, and the inertia about this edge, kg m^2."""
        side = 1.0 if direction == 'behind' else -1.0
        own = replace(self.pendulum, half_foot=self.pendulum.half_foot - side * self.ahead)
        return own, self.inertia + own.edge_inertia


def stance(scenario: Scenario | None = None) -> Stance:
    """Measure the stance in a scenario, by default without control.

    A gyro controller with an offset of its reference leans the robot at rest.
    """
    own = scenario or PushCondition().base()
    return _stance(
        own.table(GaitParameters), own.table(RunParameters), own.table(AnkleControllerParameters)
    )


_robot = functools.cache(Robot.load)


@functools.cache
def _stance(
    gait: GaitParameters, simulator: RunParameters, ankle: AnkleControllerParameters
) -> Stance:
    posture = gait_of(gait).reference(0.0)
    if ankle.source == 'gyro':
        (angles,) = AnkleController(replace(ankle, staged=False, start_ramp=0.0)).update(
            0.0, ZERO_RATE
        )
        lean = dict(zip(ANKLE_CORRECTION.names, angles, strict=True))
        posture = tuple(mix(posture, [lean]))
    plant = Plant([simulator])
    try:
        (truth,) = plant.start([posture])
    finally:
        plant.close()
    robot = _robot()
    poses = robot.poses(truth.joint_position)
    center = robot.center_of_mass(poses)
    up = poses['l_sole'][:3, 2]
    height, *levers = (
        float((center - poses[name][:3, 3]) @ up)
        for name in ('l_sole', *(robot.joints[joint].child for joint in COMPLIANT))
    )
    to_toe, to_heel = (-_x_com(truth, side, simulator) for side in (1.0, -1.0))
    return Stance(
        tuple(center.tolist()),
        Pendulum(robot.mass, height, (to_toe + to_heel) / 2.0),
        (to_heel - to_toe) / 2.0,
        tuple(levers),
        float(robot.inertia(poses, center)[1, 1]),
    )


@dataclass(frozen=True, eq=False)
class PushedBody:
    """A body after a push."""

    force: float  # of the push, N
    time: Array  # since the start of the push, s, (N,)
    # Pitch rate, rad/s, or x_COM, m, (N,): the horizontal distance of the centre of mass from the
    # toes' edge, negative behind it; for a push from the front, that from the heels' edge with the
    # opposite sign, as in the model's Recovery, so the band (4.7) is the same.
    values: Array
    fell: bool = False  # whether the motion ends with a fall
    gain: float = 0.0  # K_A; 0 is no control
    gyro: str = 'circuit'  # one of GYROS
    direction: Direction = 'behind'  # of the push


def push_robot(condition: PushCondition, force: float) -> PushedBody:
    """Push the robot with a force of at least 0, N; return its motion by x_COM."""
    scenario = condition.scenario(force)
    parameters = scenario.table(RunParameters)
    rows: list[tuple[float, float]] = []

    def watch(truth: GroundTruth, *_: object) -> None:
        rows.append((truth.stamp_ns / 1e9 - START, _x_com(truth, condition.side, parameters)))

    result = run_offline(scenario, watch)
    time, x_com = np.array(rows).T
    own = condition.gain, condition.gyro, condition.direction
    return PushedBody(force, time, x_com, result.outcome.fell, *own)


def falls(condition: PushCondition, force: float) -> bool:
    """Return whether a push with a force of at least 0, N, topples the robot."""
    return run_offline(condition.scenario(force)).outcome.fell


def _x_com(truth: GroundTruth, side: float, parameters: SimulatorParameters) -> float:
    """Return the distance of the centre of mass beyond the edge of toes (1) or heels (-1), m."""
    robot = _robot()
    center = robot.center_of_mass(robot.poses(truth.joint_position))
    ahead = float((truth.position + matrix(truth.orientation) @ center)[0])
    edge = side * float(np.max(side * corners(parameters, robot)[:, 0]))
    edges = [
        place[0] + edge * matrix(turn)[0, 0]
        for place, turn in zip(truth.sole_position, truth.sole_orientation, strict=True)
    ]
    return side * (ahead - float(np.mean(edges)))


@dataclass(frozen=True)
class PushLimit:
    """The largest survived and the smallest fatal force of the trials, N."""

    survived: float
    fatal: float

    @property
    def middle(self) -> float:
        """Return the geometric mean, N; 0 if nothing is survived."""
        return math.sqrt(self.survived * self.fatal)


def bracket(
    fatal_at: Callable[[float], bool], guess: float, tolerance: float = TOLERANCE
) -> PushLimit:
    """Bracket the largest survived force; it is 0 if LEAST is fatal.

    Args:
        fatal_at: whether a positive force in N is fatal.
        guess: N, at least LEAST.
        tolerance: largest relative distance between the two forces.
    """
    width = math.log1p(tolerance)
    survived, fatal = bracket_limit(
        lambda force: not fatal_at(math.exp(force)),
        start=math.log(guess),
        ends=(math.log(LEAST), math.inf),
        step=width,
        tolerance=width,
        growth=2.0,
    )
    return PushLimit(math.exp(survived) if survived < fatal else 0.0, math.exp(fatal))


@functools.cache
def largest_push(condition: PushCondition) -> PushLimit:
    """Find the largest push that the robot survives."""
    if condition.gain:  # the limit without control is a close guess
        guess = largest_push(replace(condition, gain=0.0)).middle
    elif condition.gyro != 'packaged':  # it has no effect without control
        return largest_push(replace(condition, gyro='packaged'))
    else:
        guess = capture_force(
            *stance(condition.base()).tipping(condition.direction), condition.duration
        )
    return bracket(functools.partial(falls, condition), max(guess, LEAST))
