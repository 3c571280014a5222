"""The simulated robot behind a virtual board: servos on its bus, sensors on its AD ports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import radians

import numpy as np

from khr_analysis.outcome import Outcome
from khr_bringup.offline import ControlLoop
from khr_bringup.scenario.scenario import Scenario
from khr_common.interfaces import FOOT_FORCES, GYRO, JOINTS, REGIONS
from khr_common.published import AD_STEP, NO_LOAD_SPEED
from khr_hardware.joint_map import COUNT, JointMap
from khr_hardware.protocol import commands
from khr_hardware.protocol.memory import AD_TOP, BATTERY_VOLTS, FREE, Config
from khr_hardware.virtual.board import PowerOnSettings, VirtualBoard
from khr_sim.physics.truth import GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from khr_sim.servo import SUPPLY, stretches

GYRO_REST_STEPS = 512  # AD steps of a gyro that does not turn
NEAR = radians(3.0)  # of the stance, in every joint
SETTLED_CYCLES = 3  # output cycles without a change of any target
OF_PROJECT = 0x809B  # the configuration of the maker's project, its ROM program on
SENSORS = ('gyro', 'foot_force')


class SimulatedRobot:
    """The robot of a scenario, one output cycle at a time.

    The robot first hangs in a stand: driven joints follow their targets at the no-load speed of the
    servos, free joints keep their angles. It is put on the ground as soon as all servos are driven
    and hold still near the first posture of the scenario; from then on physics is simulated.

    Attributes:
        stance: in which the scenario begins, 17 joint angles in rad.
        on_ground: whether it has been put down.
        battery: its voltage, V.
        pitch_rate: reading of the gyro, rad/s.
    """

    def __init__(self, scenario: Scenario, joint_map: JointMap) -> None:
        self.stance = ControlLoop(scenario).reference(0.0)
        self.battery = SUPPLY
        self._map = joint_map
        parameters = scenario.table(RunParameters)
        # The board has the delay: its targets act at once here.
        self._plant = Plant([replace(parameters, control_delay=0, duration=0.0)])
        (self._body,) = self._plant.world.bodies
        self._loop = ControlLoop(scenario, SENSORS)
        self._stretch = stretches(parameters)
        self._set: tuple[list[float], list[bool]] | None = None
        self.on_ground = False
        self._angles = [0.0] * len(JOINTS)
        self._targets: list[float | None] = [None] * len(JOINTS)
        self._still = 0
        self.pitch_rate = 0.0
        self._ad = self._at_rest()

    @property
    def trajectory_hash(self) -> str:
        """Return the hash of the trajectory on the ground; empty before."""
        return self._plant.trajectory_hash if self.on_ground else ''

    @property
    def outcome(self) -> Outcome | None:
        """Return the outcome since the robot was put on the ground; None before."""
        return self._loop.outcome

    @property
    def truth(self) -> GroundTruth:
        """Return the true state of the robot on the ground."""
        return self._plant.truths[0]

    @property
    def time(self) -> float:
        """Return the time since the robot was put on the ground, s."""
        return self.truth.stamp_ns / 1e9 if self.on_ground else 0.0

    def close(self) -> None:
        """Release the physics engine."""
        self._plant.close()

    def measure(self) -> Mapping[int, int]:
        """Return the position that each servo measures, by ICS number, trim included."""
        angles = self._body.potentiometers if self.on_ground else self._angles
        return {
            servo.ics: servo.counts(angle) + servo.trim
            for servo, angle in zip(self._map.servos.values(), angles, strict=True)
        }

    def sense(self) -> Mapping[int, int]:
        """Return the readings of the AD channels, in steps."""
        return self._ad | {0: round(self.battery / BATTERY_VOLTS)}

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Set the stretch of servos, by ICS number; servos without a joint are ignored."""
        for row, ics in enumerate(self._map.numbers):
            self._stretch[row] = stretch.get(ics, self._stretch[row])

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Advance one output cycle.

        It takes ``cycle`` s in the stand, and the scenario's control period on the ground.
        """
        before = list(self._targets)
        for row, servo in enumerate(self._map.servos.values()):
            if servo.ics in positions:
                position = positions[servo.ics]
                driven = servo.sign * (position - servo.trim - servo.zero) * COUNT + 0.0
                self._targets[row] = None if position == FREE else driven
        if not self.on_ground:
            self._still = self._still + 1 if before == self._targets else 0
            self._hang(cycle)
            if not self._ready:
                return
            self._put_down()
            return
        self._set_servos()
        free = self._body.potentiometers
        self._plant.answer(
            [
                [
                    own if goal is None else goal
                    for goal, own in zip(self._targets, free, strict=True)
                ]
            ]
        )
        self._plant.advance()
        self._observe()

    def put_down(self) -> list[float]:
        """Put the robot on the ground in its stance, by hand; return the stance."""
        self._targets = list(self.stance)
        self._put_down()
        return self.stance

    def _put_down(self) -> None:
        self._set_servos()
        self._plant.start([[goal or 0.0 for goal in self._targets]])
        self._observe()
        self.on_ground = True  # last: other threads ask for its time and servos

    def _hang(self, cycle: float) -> None:
        most = NO_LOAD_SPEED * cycle
        for row, goal in enumerate(self._targets):
            if goal is not None:
                self._angles[row] += min(max(goal - self._angles[row], -most), most)

    @property
    def _ready(self) -> bool:
        return self._still >= SETTLED_CYCLES and all(
            goal is not None and abs(goal - stance) < NEAR and abs(goal - angle) < NEAR
            for goal, stance, angle in zip(self._targets, self.stance, self._angles, strict=True)
        )

    def _set_servos(self) -> None:
        wanted = (self._stretch.tolist(), [goal is None for goal in self._targets])
        if wanted != self._set:
            self._set = wanted
            self._body.set_servos(self._stretch.copy(), np.array(wanted[1]))

    def _observe(self) -> None:
        """Update the sensors and the outcome from the truth."""
        self._loop.observe(self.truth)
        signals = self._loop.signals
        self.pitch_rate = signals[GYRO][1] if GYRO in signals else 0.0
        if self._map.gyro:
            steps = round(self.pitch_rate / self._map.gyro.step)
            self._ad[self._map.gyro.channel] = _clamped(GYRO_REST_STEPS + steps)
        for region, topic in zip(REGIONS, FOOT_FORCES, strict=True):
            if region in self._map.forces and topic in signals:
                force = self._map.forces[region]
                volts = signals[topic][2] / force.newtons_per_volt
                self._ad[force.channel] = _clamped(round(volts / AD_STEP))

    def _at_rest(self) -> dict[int, int]:
        gyro = {self._map.gyro.channel: GYRO_REST_STEPS} if self._map.gyro else {}
        return gyro | {force.channel: 0 for force in self._map.forces.values()}


def _clamped(steps: int) -> int:
    return min(max(steps, 0), AD_TOP)


def virtual_board(
    scenario: Scenario, joint_map: JointMap, on_ground: bool = False
) -> tuple[VirtualBoard, SimulatedRobot]:
    """Return a board with the robot of a scenario behind it.

    Args:
        scenario: with the ground.
        joint_map: how servos and sensors are wired; the board has its trims.
        on_ground: whether the robot stands already, held by the last targets of the board;
            by default it hangs in a stand, its servos free.
    """
    robot = SimulatedRobot(scenario, joint_map)
    parameters = scenario.table(RunParameters)
    setup = PowerOnSettings(
        joint_map.trims,
        Config(OF_PROJECT).with_cycle(parameters.control_period).word,
        {joint_map.gyro.channel: GYRO_REST_STEPS} if joint_map.gyro else {},
        parameters.control_delay,
    )
    board = VirtualBoard(robot, setup)
    if on_ground:
        board.answer(commands.move_servos(joint_map.positions(robot.put_down())))
        board.sample()
    return board, robot
