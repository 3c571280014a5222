"""Physics engine MuJoCo: soft contacts, a Newton solver, and compiled control periods.

The physics steps of a control period, with servos and contact sums, are one compiled function,
which calls ``mj_step`` in the shared library of the MuJoCo wheel.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import mujoco.viewer
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from khr_common import RunError
from khr_common.interfaces import TORSO
from khr_common.rotation import Array, carried, cross, pitched, quaternion
from khr_description.robot import JOINTS, Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.contact import FRICTION, SIDES, SPHERES, Pose, bumpers, physics_urdf
from khr_sim.physics.engines.base import Driven, Motion
from khr_sim.physics.statics import GRAVITY
from khr_sim.servo import GOAL, POSITION, TORQUE, VELOCITY, Tables, jit, law

IMPEDANCE_RATIO = 10.0  # of friction to normal force; keeps a standing foot from creeping
IMPEDANCE = (0.95, 0.99, 0.001, 0.5, 2.0)  # of a contact, as a function of its depth (solimp)
CONES = {'elliptic': mujoco.mjtCone.mjCONE_ELLIPTIC, 'pyramid': mujoco.mjtCone.mjCONE_PYRAMIDAL}
Places = NDArray[np.int64]
_NET_FORCE = 3  # reduction mode of a contact sensor: the sum of its contacts, in odom
GROUND = 1  # contact bit of the ground; those of the robots follow
_warnings: list[str] = []  # the engine would write them to a file in the working directory
mujoco.set_mju_user_warning(_warnings.append)
_library = ctypes.CDLL(mujoco._functions.__file__)
_servo_law = jit(law)
_MJ_STEP: int = ctypes.cast(_library.mj_step, ctypes.c_void_p).value or 0


@intrinsic  # type: ignore[untyped-decorator]
def _call(_context: Any, function: Any, model: Any, data: Any) -> Any:
    """Call the C function at an address with two pointers; allowed in a cached function."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), (pointer, pointer)).as_pointer()
        address, *pointers = arguments
        builder.call(
            builder.inttoptr(address, kind), [builder.inttoptr(each, pointer) for each in pointers]
        )

    return types.void(types.intp, types.intp, types.intp), generate


def _run(
    mj_step: int,
    model: int,
    data: int,
    commands: Array,
    angle_at: Places,
    speed_at: Places,
    angles: Array,
    speeds: Array,
    applied: Array,
    contacts: Array,
    servos: Array,
    constants: Array,
    position: Array,
    velocity: Array,
    forces: Array,
) -> None:
    """Advance one step per command: servos, physics, contact sums.

    Args:
        mj_step, model, data: addresses.
        commands: rad, (steps, 17 n), one robot after the other, as all joints here.
        angle_at, speed_at: places of each joint in the arrays of the engine, (17 n,).
        angles, speeds, applied: joint angles, speeds and torques of the engine.
        contacts: forces of the engine on the contact spheres of the feet, N, (8 n, 3).
        servos, constants: arguments of the servo law.
        position, velocity: joint states, written here, (17 n,).
        forces: sums of the forces on toes and heels, N, updated here, (4 n, 3).
    """
    for row in range(len(commands)):
        servos[GOAL], servos[POSITION], servos[VELOCITY] = commands[row], position, velocity
        _servo_law(servos, constants)
        for i in range(len(speed_at)):
            applied[speed_at[i]] = servos[TORQUE, i]
        _call(mj_step, model, data)
        for i in range(len(speed_at)):
            position[i], velocity[i] = angles[angle_at[i]], speeds[speed_at[i]]
        for sphere in range(len(contacts)):
            for axis in range(3):
                forces[sphere // 2, axis] += contacts[sphere, axis]


_compiled_run = jit(_run)


class MuJoCoBody:
    """One robot in the MuJoCo model.

    Args:
        model, data: of all robots.
        robot: its description.
        prefix: of its names.
        states: joint angles and speeds in the order of JOINTS, (2, 17).
    """

    def __init__(self, model: Any, data: Any, robot: Robot, prefix: str, states: Array) -> None:
        self._model, self._data = model, data
        self.links: Mapping[str, int] = {
            name: model.body(prefix + name).id for name, link in robot.links.items() if link.mass
        }
        joints = [model.joint(prefix + name) for name in JOINTS]
        self.angle_at = np.array([int(joint.qposadr[0]) for joint in joints])
        self.speed_at = np.array([int(joint.dofadr[0]) for joint in joints])
        base = model.joint(int(model.body_jntadr[self.links[TORSO]]))
        at, speed_at = int(base.qposadr[0]), int(base.dofadr[0])
        self._base = data.qpos[at : at + 7], data.qvel[speed_at : speed_at + 6]
        self._links = data.xpos, data.xquat
        self._position, self._velocity = states

    def place(self, position: Array, rotation: Array, posture: Sequence[float]) -> None:
        """Place base_link in odom, m and (3, 3), at rest, the joints at angles in rad."""
        x, y, z, w = quaternion(rotation)
        pose, velocity = self._base
        pose[:] = *position, w, x, y, z
        velocity[:] = 0.0
        self._data.qpos[self.angle_at] = posture
        self._data.qvel[self.speed_at] = 0.0
        self._position[:], self._velocity[:] = posture, 0.0
        mujoco.mj_kinematics(self._model, self._data)

    def push(self, link: int, force: Array, point: Array) -> None:
        """Apply a force in N at a point in m, both in odom, during the next step only."""
        arm = point - self._data.xipos[link]
        self._data.xfrc_applied[link] += (*force, *cross(arm, force))

    def base(self) -> Motion:
        """Return the motion of base_link."""
        pose, velocity = self._base
        x, y, z, qw, qx, qy, qz = pose.tolist()
        vx, vy, vz, *turning = velocity.tolist()
        orientation = qx, qy, qz, qw
        return Motion((x, y, z), orientation, (vx, vy, vz), carried(orientation, turning))

    def joints(self) -> tuple[Array, Array]:
        """Return the joint angles in rad and the joint speeds in rad/s, both (17,)."""
        return self._position, self._velocity

    def poses(self, links: Sequence[int]) -> list[Pose]:
        """Return the poses of links other than the torso."""
        positions, orientations = self._links
        poses: list[Pose] = []
        for link in links:
            qw, qx, qy, qz = orientations[link].tolist()
            poses.append((tuple(positions[link].tolist()), (qx, qy, qz, qw)))
        return poses


class MuJoCo:
    """Simulate robots in a MuJoCo model of their own."""

    def __init__(self, parameters: SimulatorParameters, robot: Robot, robots: int = 1) -> None:
        self._model = model = _specify(parameters, robot, robots).compile()
        self._data = data = mujoco.MjData(model)
        states = np.zeros((2, robots, len(JOINTS)))
        self.bodies = [
            MuJoCoBody(model, data, robot, _prefix(number), states[:, number])
            for number in range(robots)
        ]
        self._states = tuple(states.reshape(2, -1))
        self._pushes = data.xfrc_applied
        self._addresses = _MJ_STEP, model._address, data._address
        self._views = (
            np.concatenate([body.angle_at for body in self.bodies]),
            np.concatenate([body.speed_at for body in self.bodies]),
            data.qpos,
            data.qvel,
            data.qfrc_applied,
            data.sensordata.reshape(-1, 3),
        )
        self._viewer = mujoco.viewer.launch_passive(model, data) if parameters.gui else None

    def reset(self, inclination: float) -> None:
        """Restart on ground inclined by an angle in rad."""
        mujoco.mj_resetData(self._model, self._data)
        self.tilt_ground(inclination)

    def tilt_ground(self, inclination: float) -> None:
        """Incline the ground about the origin by an angle in rad."""
        x, y, z, w = pitched(inclination)
        self._data.mocap_quat[0] = w, x, y, z

    def set_friction(self, coefficient: float) -> None:
        """Set the friction coefficient between robots and ground."""
        self._model.geom('ground').friction[0] = coefficient

    def run(self, commands: Array, tables: Tables, robots: Sequence[Driven]) -> None:
        """Advance one step per row of ``commands``."""
        _compiled_run(
            *self._addresses,
            commands,
            *self._views,
            tables.servos,
            tables.constants,
            *self._states,
            tables.forces,
        )
        if _warnings:
            raise RunError(f'mujoco: {_warnings.pop()}')
        for robot in robots:
            robot.forces.steps += len(commands)
        self._pushes[:] = 0.0
        # mj_step leaves the link poses of the start of the step
        mujoco.mj_kinematics(self._model, self._data)
        if self._viewer is not None:
            self._viewer.sync()

    def close(self) -> None:
        """Close the viewer window, if open."""
        if self._viewer is not None:
            self._viewer.close()


def _prefix(number: int) -> str:
    return f'{number}/' if number else ''


def _specify(parameters: SimulatorParameters, robot: Robot, robots: int) -> Any:
    """Return the MuJoCo specification of robots and ground."""
    spec, *others = [_robot(parameters, robot, number, robots) for number in range(robots)]
    for number, other in enumerate(others, 1):
        spec.attach(other, prefix=_prefix(number), frame=spec.worldbody.add_frame())
    ground = spec.worldbody.add_body(name='ground', mocap=True)
    ground.add_geom(
        name='ground',
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(5.0, 5.0, 0.1),
        contype=GROUND,
        conaffinity=0,
        condim=3,
        priority=1,  # its contact parameters take precedence
        solref=(parameters.contact_time, 1.0),
        solimp=IMPEDANCE,
    )
    for number in range(robots):
        for side in SIDES:
            for sphere in range(SPHERES):
                spec.add_sensor(
                    type=mujoco.mjtSensor.mjSENS_CONTACT,
                    objtype=mujoco.mjtObj.mjOBJ_GEOM,
                    objname='ground',
                    reftype=mujoco.mjtObj.mjOBJ_GEOM,
                    refname=f'{_prefix(number)}{side}_foot_{sphere}',
                    intprm=(1 << mujoco.mjtConDataField.mjCONDATA_FORCE.value, _NET_FORCE, 1),
                )
    option = spec.option
    option.timestep = parameters.physics_step
    option.gravity = 0.0, 0.0, -GRAVITY
    option.iterations = parameters.solver_iterations
    option.tolerance = parameters.solver_tolerance
    option.cone = CONES[parameters.friction_cone]
    option.impratio = IMPEDANCE_RATIO
    option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE  # the faster of the two for this robot
    # One robot is a single island, which needs no search. An unstable state must end the run, but
    # by default the engine resets itself and continues.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    # Testing the four spheres of a foot directly is faster than a mid-phase with bounding boxes.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    return spec


def _robot(parameters: SimulatorParameters, robot: Robot, number: int, robots: int) -> Any:
    """Return the specification of one robot; it collides with the ground and other robots.

    Two geoms collide if the bits of one's ``contype`` meet those of the other's ``conaffinity``:
    the ground has a bit, and each robot has one that only the other robots meet.
    """
    spec = mujoco.MjSpec.from_string(physics_urdf(parameters, robot, robots))
    own = GROUND << (1 + number)
    others = sum(GROUND << (1 + other) for other in range(robots) if other != number)
    apart = bumpers(robot) if robots > 1 else {}
    for body in spec.bodies:
        for geom in body.geoms:
            ground = body.name not in apart or geom.type == mujoco.mjtGeom.mjGEOM_SPHERE
            geom.contype = own if others else 0
            geom.conaffinity = others + GROUND * ground
            if others:
                geom.friction[0] = FRICTION
                geom.solref, geom.solimp = (parameters.contact_time, 1.0), IMPEDANCE
    spec.body(TORSO).add_freejoint()
    for side in SIDES:
        spheres = spec.body(f'{side}_foot').geoms[:SPHERES]
        assert all(sphere.type == mujoco.mjtGeom.mjGEOM_SPHERE for sphere in spheres)
        for sphere_number, sphere in enumerate(spheres):
            sphere.name = f'{side}_foot_{sphere_number}'
    return spec
