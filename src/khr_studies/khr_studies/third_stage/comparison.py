"""The plane of the third stage compared with the linear model of standing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import nan
from typing import NamedTuple

import numpy as np
import pandas as pd

from khr_models.standing.force_loop import StandingLoop
from khr_studies.third_stage.standing_model import standing_loop
from khr_studies.third_stage.study import HIP_GAIN, Array, Plane, Setting


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

    return ModelComparison(
        edges(plane),
        {hip: grown(hip) for hip in hips},
        tuple(
            ModelLoop(feet, hip, loop_at(near._replace(hip_gain=hip), feet))
            for feet, hip in product((2, 1), hips)
        ),
    )


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
