"""The balance of the robot: centre of mass, capture point and centre of pressure over the soles.

The live page, playback, report and film all show the quantities that are computed here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, nan, sin, sqrt, tan
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from khr_common.rotation import Array, heading_of, matrix
from khr_description.robot import Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.contact import SIDES, corners
from khr_sim.physics.statics import GRAVITY

LOADED = 1.0  # N on a sole from which on it supports


class Margins(NamedTuple):
    """Places along the ground, m ahead of the middle between heel edge and toe edge.

    Ahead is the heading of the robot, see :func:`khr_common.rotation.heading_of`.
    """

    center: float  # of mass, projected vertically onto the slope
    # capture point: where the robot has to step to come to rest over it, the centre of mass plus
    # its velocity times sqrt(h/g) (Pratt et al. 2006, Hof et al. 2005).
    capture: float
    pressure: float  # centre of pressure of the ground's normal forces
    # toe, heel: foremost and rearmost edge of the loaded soles
    toe: float
    heel: float


AIRBORNE = Margins(nan, nan, nan, nan, nan)


@dataclass(frozen=True, eq=False)
class Balance:
    """The balance at one sample; points in odom, m: z upward, the slope through the origin."""

    poses: dict[str, Array]  # of all links, (4, 4) each
    center_of_mass: Array  # (3,)
    below: Array  # its vertical projection onto the slope, (3,)
    capture: Array  # the capture point on the slope, (3,); equal to below without a sample before
    pressure: Array  # the centre of pressure, (3,); NaN in the air
    # corners of the convex hull of the loaded soles, in order, (n, 3); empty in the air
    support: Array
    margins: Margins  # along the slope; NaN in the air
    axes: Array  # unit vectors along the slope in the heading of the robot: ahead and left, (2, 3)


class BalanceModel:
    """Compute the balance of one robot.

    Args:
        robot: its description.
        parameters: of the simulator, for the width of the soles.
    """

    def __init__(self, robot: Robot, parameters: SimulatorParameters) -> None:
        self._robot = robot
        self._corners = np.column_stack([corners(parameters, robot), np.ones(4)])

    def at(
        self,
        pose: Sequence[float],
        joints: Sequence[float],
        inclination: float,
        normal_forces: Sequence[float],
        before: Balance | None = None,
        period: float = 0.0,
    ) -> Balance:
        """Return the balance at a sample.

        Args:
            pose: of base_link in odom: x y z, quaternion x y z w.
            joints: 17 angles, rad.
            inclination: of the slope, rad.
            normal_forces: on l_toe, l_heel, r_toe, r_heel, N.
            before: the balance at an earlier sample, for the velocity of the centre of mass.
            period: time since then, s.
        """
        in_odom = np.eye(4)
        in_odom[:3, 3], in_odom[:3, :3] = pose[:3], matrix(pose[3:])
        poses = {name: in_odom @ each for name, each in self._robot.poses(joints).items()}
        center = self._robot.center_of_mass(poses)
        below = _on_slope(center, inclination)
        capture = below
        if before is not None and period > 0.0:
            velocity = (center - before.center_of_mass) / period
            height = max(float(center[2] - below[2]), 0.0)
            capture = _on_slope(center + velocity * sqrt(height / GRAVITY), inclination)
        soles = [(poses[f'{side}_sole'] @ self._corners.T).T[:, :3] for side in SIDES]
        forces = np.maximum(normal_forces, 0.0)
        carry = [soles[n] for n in range(2) if forces[2 * n] + forces[2 * n + 1] > LOADED]
        pressure = np.full(3, nan)
        margins, axes = AIRBORNE, _axes(heading_of(*pose[3:]), inclination)
        if carry:
            # The rows of the corners are two at the toe, then two at the heel.
            ends = np.concatenate([sole.reshape(2, 2, 3).mean(axis=1) for sole in soles])
            pressure = np.asarray(forces @ ends / forces.sum())
            ahead = axes[0]
            edges = np.concatenate(carry) @ ahead
            toe, heel = float(edges.max()), float(edges.min())
            middle = (toe + heel) / 2.0
            margins = Margins(
                float(below @ ahead) - middle,
                float(capture @ ahead) - middle,
                float(pressure @ ahead) - middle,
                toe - middle,
                heel - middle,
            )
        return Balance(poses, center, below, capture, pressure, _hull(carry), margins, axes)


@dataclass(frozen=True, eq=False)
class BalanceSeries:
    """The margins over time, m, (N,) each; names as of :class:`Margins`."""

    center: Array
    capture: Array
    pressure: Array
    toe: Array
    heel: Array


def balance_of(series: Any, robot: Robot, parameters: SimulatorParameters) -> BalanceSeries | None:
    """Return the margins of a Series over time; None if its poses were not kept."""
    found = balances_of(series, robot, parameters)
    return None if found is None else margins_of(found)


def margins_of(balances: Sequence[Balance | None]) -> BalanceSeries:
    """Return the margins over time; NaN where the balance is not known."""
    rows = [each.margins if each else AIRBORNE for each in balances]
    return BalanceSeries(*np.array(rows, dtype=np.float64).reshape(-1, len(Margins._fields)).T)


def balances_of(
    series: Any, robot: Robot, parameters: SimulatorParameters
) -> list[Balance | None] | None:
    """Return the balance at each sample of a Series, None at a sample lost in the bag.

    It is None as a whole if the poses were not kept.
    """
    if series.pose is None or series.joints is None:
        return None
    model, found = BalanceModel(robot, parameters), list[Balance | None]()
    samples = zip(
        series.pose.tolist(),
        series.joints.tolist(),
        series.inclination.tolist(),
        series.contact_force.tolist(),
        np.diff(series.time, prepend=series.time[:1]).tolist(),
        strict=True,
    )
    for pose, joints, inclination, forces, period in samples:
        known = np.isfinite((*pose, *joints, inclination, *forces)).all()
        before = found[-1] if found else None
        found.append(
            model.at(pose, joints, inclination, forces, before, period) if known else None
        )
    return found


def _axes(heading: float, inclination: float) -> Array:
    """Return unit vectors along the slope, ahead and left of a heading, (2, 3)."""
    down = np.array([cos(inclination), 0.0, -sin(inclination)])
    across = np.array([0.0, 1.0, 0.0])
    turn, aside = cos(heading), sin(heading)
    return np.array([turn * down + aside * across, turn * across - aside * down])


def _on_slope(point: Array, inclination: float) -> Array:
    """Return the vertical projection of a point onto the slope."""
    return np.array([point[0], point[1], -point[0] * tan(inclination)])


def _hull(soles: Sequence[Array]) -> Array:
    if not soles:
        return np.zeros((0, 3))
    points = np.concatenate(soles)
    try:
        return np.asarray(points[ConvexHull(points[:, :2]).vertices])
    except QhullError:  # a sole on its edge, seen from above
        return np.zeros((0, 3))
