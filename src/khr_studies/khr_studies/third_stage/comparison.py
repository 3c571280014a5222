"""The plane of the third stage beside the linear model of standing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import nan
from typing import NamedTuple

import numpy as np

from khr_models.standing.force_loop import StandingLoop
from khr_studies.third_stage.standing_model import standing_loop
from khr_studies.third_stage.study import HIP_GAIN, Array, Plane, Setting


@dataclass(frozen=True)
class Edge:
    """Where the loop begins to topple the robot on the flat, measured and from the linear model.

    Attributes:
        time_constant: of the force sensors, s.
        without_hip, with_hip: force scales, V/N, the second with the rate alone, as the model has
            it; None if they lie outside of the plane.
        growth: of the model's worst motion at ``without_hip``, 1/s.
        predicted: force scale at which the model with the hip grows as fast as those without do
            on average; None if that lies outside of the plane.
    """

    time_constant: float
    without_hip: float | None
    with_hip: float | None
    growth: float | None
    predicted: float | None


class ModelLoop(NamedTuple):
    """The model at the point nearest to the thesis's limits."""

    feet: int
    hip_gain: float
    model: StandingLoop


@dataclass(frozen=True)
class ModelComparison:
    """What the linear model has of a plane.

    Attributes:
        edges: one for each time constant.
        growth: of its worst motion on the flat without the hip and with it, 1/s, each
            (times, scales), by hip gain.
        loops: at the point nearest to the thesis's limits, on one foot and on two.
    """

    edges: tuple[Edge, ...]
    growth: dict[float, Array]
    loops: tuple[ModelLoop, ...]


def compare_with_model(plane: Plane) -> ModelComparison:
    """Return what the linear model has of a plane."""
    near = plane.nearest
    hips = 0.0, HIP_GAIN
    return ModelComparison(
        tuple(edges(plane)),
        {
            hip: np.array(
                [[growth(scale, time, hip) for scale in plane.scales] for time in plane.times]
            )
            for hip in hips
        },
        tuple(
            ModelLoop(feet, hip, loop_at(Setting(near.force_scale, near.time_constant, hip), feet))
            for feet in (2, 1)
            for hip in hips
        ),
    )


def growth(scale: float, time: float, hip_gain: float, feet: int = 2) -> float:
    """Return how fast the linear model's worst motion grows on the flat, 1/s."""
    return loop_at(Setting(scale, time, hip_gain), feet).growth


def loop_at(setting: Setting, feet: int) -> StandingLoop:
    """Return the linear model at a point of the plane, on the flat, on one foot or two."""
    unit = _of_unit_scale(setting.hip_gain, feet)
    return replace(
        unit, ankle_gain=setting.force_scale * unit.ankle_gain, force_time=setting.time_constant
    )


@cache
def _of_unit_scale(hip_gain: float, feet: int) -> StandingLoop:
    """Return the model for 1 V/N: to plan the posture takes a fifth of a second."""
    return standing_loop(Setting(1.0, 1.0, hip_gain).condition('bullet').scenario(0.0), feet)


def edges(plane: Plane) -> list[Edge]:
    """Compare where the robot is toppled with where the linear model swings.

    The model has no dry friction, which takes energy from every swing. What it takes is one number,
    the growth rate that the robot without the hip just bears, here its mean over the time
    constants; that number then predicts the edge with the hip.
    """
    measured = {time: plane.edge(time, 0.0) for time in plane.times}
    rates = {
        time: growth(scale, time, 0.0) for time, scale in measured.items() if scale is not None
    }
    borne = float(np.mean([*rates.values()])) if rates else nan
    return [
        Edge(
            time,
            measured[time],
            plane.edge(time, HIP_GAIN),
            rates.get(time),
            _scale_at(borne, time, plane.scales),
        )
        for time in plane.times
    ]


def _scale_at(rate: float, time: float, scales: Sequence[float]) -> float | None:
    rates = [growth(scale, time, HIP_GAIN) for scale in scales]
    if not rates[0] <= rate <= rates[-1]:
        return None
    return float(np.interp(rate, rates, scales))
