"""The plane of the third stage compared with the linear model of standing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import nan, tau
from typing import NamedTuple

import numpy as np
import pandas as pd

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_balance.feedback import force_gain, rate_gain
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.scenario import Scenario
from khr_description.robot import JOINTS, Robot
from khr_models.standing.force_loop import Chain, JointServos, StandingLoop
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors import FootForceParameters, GyroParameters
from khr_sim.servo import BACK_EMF, gear_stiffness, position_loop
from khr_studies.third_stage.study import HIP_GAIN, Array, Plane, Setting

CHAIN = ('ankle_pitch', 'knee', 'hip_pitch')


def standing_loop(scenario: Scenario, feet: int) -> StandingLoop:
    """Return the linear model of a leg lift.

    Args:
        scenario: of the leg lift, with its gains.
        feet: 2 before the lift, or 1 while a leg is up.
    """
    gait = scenario.table(GaitParameters)
    time = 0.0 if feet == 2 else gait.start_delay + gait.shift_time + gait.lift_time
    posture = np.asarray(gait_of(gait).reference(time), dtype=np.float64)
    sides = 'lr' if feet == 2 else ('l' if gait.first_foot == 'right' else 'r')
    simulator = scenario.table(RunParameters)
    ankle, hip = scenario.table(AnkleControllerParameters), scenario.table(HipControllerParameters)
    servo = position_loop(simulator)
    # The derivative term brakes the rotor as its back-EMF does. Its response to a moving command is
    # omitted, and so is the integral term, which is far slower than a swing.
    braking = BACK_EMF + servo.derivative

    def of_legs(values: float | Array) -> Array:
        by_joint = dict(zip(JOINTS, np.broadcast_to(values, len(JOINTS)), strict=True))
        return np.array([sum(by_joint[f'{side}_{name}'] for side in sides) for name in CHAIN])

    return StandingLoop(
        chain_of(Robot.load(), posture, sides),
        JointServos(
            of_legs(servo.stiffness),
            of_legs(gear_stiffness(simulator)),
            of_legs(simulator.gear_damping),
            of_legs(simulator.rotor_inertia),
            of_legs(braking),
        ),
        simulator.pad_distance,
        force_gain(ankle.gain, ankle.force_scale) if ankle.enabled else 0.0,
        rate_gain(hip.gain * hip.gain_unit) if hip.enabled else 0.0,
        scenario.table(FootForceParameters).time_constant,
        1.0 / (tau * scenario.table(GyroParameters).bandwidth),
        simulator.control_period,
        simulator.control_delay,
    )


def chain_of(robot: Robot, posture: Array, sides: str) -> Chain:
    """Return the robot above its standing feet as one planar chain.

    A lifted leg is part of the thigh body: both hips receive the same correction, so it stays
    parallel to the standing leg.

    Args:
        posture: 17 joint angles, rad.
        sides: standing legs, ``l``, ``r`` or ``lr``.
    """
    poses = robot.poses(posture)
    first = sides[0]
    sole = poses[f'{first}_sole'][:3, :3]
    children = {name: robot.joints[f'{first}_{name}'].child for name in CHAIN}
    origin = poses[children['ankle_pitch']][:3, 3]
    above: dict[str, set[str]] = {}
    for name in CHAIN:
        legs = [set(robot.descendants(robot.joints[f'{s}_{name}'].child)) for s in 'lr']
        standing = [leg for leg, s in zip(legs, 'lr', strict=True) if s in sides]
        above[name] = set.union(*standing)
    raised = {s for s in 'lr' if s not in sides}
    lifted = {
        link for s in raised for link in robot.descendants(robot.joints[f'{s}_hip_pitch'].child)
    }
    bodies = (
        above['knee'] - above['ankle_pitch'],
        (above['hip_pitch'] - above['knee']) | lifted,
        set(robot.links) - above['hip_pitch'] - lifted,
    )
    masses, centres, inertias = [], [], []
    for links in bodies:
        names = [name for name in robot.links if name in links]
        mass = sum(robot.links[name].mass for name in names)
        moments = [
            robot.links[name].mass * (poses[name] @ (*robot.links[name].center_of_mass, 1.0))[:3]
            for name in names
        ]
        centre = np.asarray(np.sum(moments, axis=0) / mass)
        turned = sole.T @ robot.inertia(poses, centre, names) @ sole
        masses.append(mass)
        centres.append((sole.T @ (centre - origin))[[0, 2]])
        inertias.append(turned[1, 1])
    joints = [(sole.T @ (poses[children[name]][:3, 3] - origin))[[0, 2]] for name in CHAIN]
    return Chain(np.array(joints), np.array(masses), np.array(centres), np.array(inertias))


class ModelLoop(NamedTuple):
    """The model at the point nearest to the thesis's limits, on one foot or two."""

    feet: int
    hip_gain: float
    model: StandingLoop


@dataclass(frozen=True, eq=False)
class ModelComparison:
    """The linear model over a plane."""

    edges: pd.DataFrame  # of edges
    # of the worst motion on the flat, 1/s, (times, scales), by hip gain
    growth: dict[float, Array]
    loops: tuple[ModelLoop, ...]  # at the point nearest to the thesis's limits


def compare_with_model(plane: Plane) -> ModelComparison:
    """Compare a plane with the linear model of standing."""
    near, hips = plane.nearest, (0.0, HIP_GAIN)

    def grown(hip: float) -> Array:
        rows = [[growth(scale, time, hip) for scale in plane.scales] for time in plane.times]
        return np.array(rows)

    loops = tuple(
        ModelLoop(feet, hip, loop_at(near._replace(hip_gain=hip), feet))
        for feet, hip in product((2, 1), hips)
    )
    return ModelComparison(edges(plane), {hip: grown(hip) for hip in hips}, loops)


@cache
def growth(scale: float, time: float, hip_gain: float) -> float:
    """Return the growth rate of the model's worst motion on the flat, on two feet, 1/s."""
    return loop_at(Setting(scale, time, hip_gain), 2).growth


def loop_at(setting: Setting, feet: int) -> StandingLoop:
    """Return the linear model at a point of the plane, on the flat, on one foot or two."""
    unit = _unit_scale_loop(setting.hip_gain, feet)
    return replace(
        unit, ankle_gain=setting.force_scale * unit.ankle_gain, force_time=setting.time_constant
    )


@cache
def _unit_scale_loop(hip_gain: float, feet: int) -> StandingLoop:
    """Return the model for 1 V/N; cached because its posture takes 0.2 s to plan."""
    return standing_loop(Setting(1.0, 1.0, hip_gain).condition('bullet').scenario(0.0), feet)


def edges(plane: Plane) -> pd.DataFrame:
    """Compare where the robot topples on the flat with where the model predicts it.

    Dry friction is not in the model. It is lumped into one fitted threshold: the growth rate of
    the model at the edge without the hip, averaged over the time constants. The prediction is the
    force scale at which the model with the hip reaches this rate.

    Returns:
        A row per time constant (``time_constant``, s) with the measured edges ``without_hip`` and
        ``with_hip``, V/N, the model's ``growth`` at ``without_hip``, 1/s, and the
        ``predicted`` edge with the hip, V/N; NaN for an edge outside of the plane.
    """
    table = pd.DataFrame({'time_constant': plane.times})
    for name, hip in (('without_hip', 0.0), ('with_hip', HIP_GAIN)):
        found = [plane.edge(time, hip) for time in plane.times]
        table[name] = [nan if edge is None else edge for edge in found]
    table['growth'] = [
        nan if np.isnan(scale) else growth(scale, time, 0.0)
        for scale, time in zip(table['without_hip'], plane.times, strict=True)
    ]
    threshold = float(table['growth'].mean())
    table['predicted'] = [_scale_at(threshold, time, plane.scales) for time in plane.times]
    return table


def _scale_at(rate: float, time: float, scales: Sequence[float]) -> float:
    """Return the force scale at which the model with the hip grows at a rate, 1/s."""
    rates = [growth(scale, time, HIP_GAIN) for scale in scales]
    return float(np.interp(rate, rates, scales)) if rates[0] <= rate <= rates[-1] else nan
