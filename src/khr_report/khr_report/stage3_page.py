"""``khr stage3``: what the hip's damping is worth to a standing robot: page, data, picture."""

from __future__ import annotations

from math import degrees, isnan
from pathlib import Path

import numpy as np

from khr_common.files import write_text
from khr_experiments.json_file import read_json, write_json
from khr_figures.plot_style import save
from khr_figures.stage3 import plane_picture
from khr_report.page.document import Block, Columns, Passage, Table, markdown, number, table
from khr_tuning.stage3 import (
    ANKLE_GAIN,
    HIP_GAIN,
    SCALES,
    THESIS,
    TIMES,
    WITHIN,
    WORTH,
    Edge,
    Plane,
    Point,
    Setting,
    edges,
    loop_at,
    measure,
)

ROOT = Path('runs/stage3')
HEAD = f"""# The third stage

Written by `khr stage3`; do not edit. The numbers are in [stage3.json](stage3.json).

A robot that stands on one leg holds {THESIS[0]:g} deg without control, {THESIS[1]:g} deg with the
toe-heel difference fed back to its ankles, and {THESIS[2]:g} deg with the pitch rate fed back to its
hips as well (Dutta, 2021). But a rate is zero at rest: (3.14) holds no lean. What is the third stage
made of? Two things, which are measured apart: the hip's rate takes energy out of a swing, and where
the gyro's reference is off, as the calibration has it ([calibration.md](calibration.md)), the hip
leans the torso back by K_H times as much. The ankles' loop (3.13) has two constants that nothing
published fixes, the scale of the force sensors and their time constant. The plane of both, with
K_A {ANKLE_GAIN:g}:"""
CAPTION = """*Solid lines: the scale beyond which the robot falls on the flat already, without the hip and
with its rate alone; dotted: where the linear model expects it with the hip.*"""
MODEL = """`khr_analysis.models.force_loop` is the loop without dry friction, linear, with the board's
period and delay: three joints with their servos on a foot that stays flat, the low-passes of force
sensors and gyro. By its eigenvalues the ankles' loop swings as soon as it is strong or fast, and the
rate fed back to the hips takes energy out of that swing. The robot bears some growth of it: the dry
friction of its servos, which the model leaves out, takes energy too. How much it bears is one number,
read off the edge without the hip; the edge with the hip then is a prediction."""


def write(out: Path, seeds: int, engine: str, jobs: int) -> str:
    """Measure the plane, write page, data and picture; return a summary of one line.

    Raises:
        ExperimentError: if an argument is not accepted.
        KhrError, RunError, OSError: if a file cannot be written.
    """
    plane = measure(seeds, engine, jobs, ROOT, SCALES, TIMES)
    write_json(out.with_suffix('.json'), plane)
    return render(plane, out)


def again(out: Path) -> str:
    """Write page and picture from the data beside the page, without measuring.

    Raises:
        ExperimentError: if there are no such data.
    """
    return render(read_json(out.with_suffix('.json'), Plane), out)


def render(plane: Plane, out: Path) -> str:
    """Write page and picture; return a summary."""
    found = edges(plane)
    picture = out.with_suffix('.png')
    figure = plane_picture(plane, found)
    save(figure, picture, dpi=120)
    image = f'![Limits, overshoot and damping over the plane]({picture.name})'
    write_text(out, markdown([HEAD, image, CAPTION, *blocks(plane, found)]) + '\n')
    return summary(plane)


def summary(plane: Plane) -> str:
    """Say where the hip is worth most."""
    worth = plane.worth
    time, scale = np.unravel_index(int(np.argmax(worth)), worth.shape)
    near = plane.nearest
    return (
        f"the hip's rate is worth {worth.max():.1f} deg at {_place(plane.scales[scale], plane.times[time])}"
        f'; nearest to the thesis: {_place(near.force_scale, near.time_constant)}'
    )


def blocks(plane: Plane, found: list[Edge]) -> list[Block]:
    """Return what the page says of a plane."""
    return [
        Passage('What holds the robot', (_holds(plane), _thesis(plane))),
        Passage('Why: the swing of the loop', (MODEL, table(found, EDGES), _verdict(found))),
        Passage('The limits', _grids(plane)),
        Passage('The loop at the marked point', (_loops(plane),)),
        Passage('On the other engine', (table(plane.checks, _checks(plane)), _seeds(plane))),
    ]


def _place(scale: float, time: float) -> str:
    return f'{1e3 * scale:g} mV/N and {time:g} s'


def _holds(plane: Plane) -> str:
    worth, without = plane.worth, plane.limits(0.0)
    with_hip, offset = plane.limits(HIP_GAIN, offset=False), plane.worth_of_offset
    held = worth >= WORTH
    toppled = held & (without == 0.0)
    text = (
        f"At {held.sum()} of {worth.size} points the hip's rate raises the limit by {WORTH:g} deg or "
        'more. '
        f'At {toppled.sum()} of them the ankles alone topple the robot on the flat. '
    )
    if held.any():
        off = max(
            plane.columns_off(plane.times[row], plane.scales[column])
            for row, column in np.argwhere(held)
        )
        text += (
            f'All {held.sum()} lie within {off:.1f} columns of the edge beyond which the ankles alone '
            f'topple it; with the rate their limit is {with_hip[held].min():.1f} to '
            f'{with_hip[held].max():.1f} deg. '
        )
    others = (without > 0.0) & ~held
    if others.any():
        text += (
            f'At the {others.sum()} other points where the robot stands without the hip, the rate '
            f'adds {worth[others].mean():+.2f} deg on average, {worth[others].min():+.1f} to '
            f'{worth[others].max():+.1f}: it holds no lean. There the offset adds '
            f'{offset[others].mean():+.2f} deg, {offset[others].min():+.1f} to '
            f'{offset[others].max():+.1f}.'
        )
    return text


def _thesis(plane: Plane) -> str:
    near = plane.nearest
    pair = [Setting(near.force_scale, near.time_constant, hip) for hip in (0.0, HIP_GAIN)]
    limits = (plane.without.limit_deg, *(plane.at(each).limit_deg for each in pair))
    misses = [abs(limit - thesis) for limit, thesis in zip(limits, THESIS, strict=True)]
    text = (
        f"Of all points, {_place(near.force_scale, near.time_constant)} come nearest to the thesis's "
        f'{THESIS[0]:g}, {THESIS[1]:g} and {THESIS[2]:g} deg: {limits[0]:.1f}, {limits[1]:.1f} and '
        f'{limits[2]:.1f} deg, '
        + (
            f'each within {WITHIN:g} deg.'
            if max(misses) <= WITHIN
            else f'not each within {WITHIN:g} deg.'
        )
    )
    checked = [point.limit_deg for point in plane.checks if point.setting in pair]
    if len(checked) == len(pair):
        text += (
            f' On the other engine the same point gives {checked[0]:.1f} and {checked[1]:.1f} deg.'
        )
    return (
        f'{text} The point was chosen for this, from {plane.worth.size}: that the limits can be met '
        'is shown, not that these are the constants of the real sensors.'
    )


def _scale(value: float | None) -> str:
    return number(None if value is None else 1e3 * value, 2)


EDGES: Columns[Edge] = {
    'time constant, s': lambda row: f'{row.time_constant:g}',
    'edge without the hip, mV/N': lambda row: _scale(row.without_hip),
    "model's growth there, 1/s": lambda row: number(row.growth, 2),
    'edge with the hip, mV/N': lambda row: _scale(row.with_hip),
    'predicted, mV/N': lambda row: _scale(row.predicted),
}


def _verdict(found: list[Edge]) -> str:
    rates = [edge.growth for edge in found if edge.growth is not None]
    pairs = [(e.with_hip, e.predicted) for e in found if e.with_hip and e.predicted]
    if len(rates) < 2 or not pairs:
        return 'Too few edges lie within the plane for a comparison.'
    shifts = [
        (e.with_hip - e.without_hip, e.predicted - e.without_hip)
        for e in found
        if e.with_hip and e.predicted and e.without_hip
    ]
    misses = [abs(measured - predicted) for measured, predicted in pairs]
    measured, predicted = np.mean(shifts, axis=0) if shifts else (np.nan, np.nan)
    return (
        f'Without the hip the robot bears {np.mean(rates):.2f} 1/s on average, {min(rates):.2f} to '
        f'{max(rates):.2f} over the time constants. The hip moves the edge by '
        f'{1e3 * measured:.2f} mV/N on average, the model says {1e3 * predicted:.2f}; the single '
        f'predictions miss by up to {1e3 * max(misses):.2f} mV/N, and an edge is known to half the '
        f'distance of two columns.'
    )


def _grids(plane: Plane) -> tuple[Block, ...]:
    def cell(point: Point) -> str:
        rate = '-' if isnan(point.overshoot) else f'{degrees(point.overshoot):.0f}'
        return f'{point.limit_deg:.1f} ({rate})'

    parts: list[Block] = [
        'Limits in deg, and in brackets the largest pitch rate of the lift at 3.8 deg, in deg/s. '
        'Rows: time constant in s; columns: force scale in mV/N. A limit is climbed to from the '
        'flat, so that a loop that swings on gentle ground has none.'
    ]
    for hip, offset, name in (
        (0.0, True, 'K_H 0'),
        (HIP_GAIN, False, f'K_H {HIP_GAIN:g}, the rate alone'),
        (HIP_GAIN, True, f'K_H {HIP_GAIN:g}, with the offset'),
    ):
        rows = (
            (
                f'{time:g}',
                *(cell(plane.at(Setting(scale, time, hip, offset))) for scale in plane.scales),
            )
            for time in plane.times
        )
        parts += [
            f'K_A {ANKLE_GAIN:g}, {name}:',
            Table(('', *(f'{1e3 * scale:g}' for scale in plane.scales)), tuple(rows)),
        ]
    return tuple(parts)


def _loops(plane: Plane) -> Table:
    """Return the model's swings at the point nearest to the thesis's limits."""
    near = plane.nearest
    rows = []
    for feet, hip in ((2, 0.0), (2, HIP_GAIN), (1, 0.0), (1, HIP_GAIN)):
        loop = loop_at(Setting(near.force_scale, near.time_constant, hip), feet)
        rows.append(
            (
                str(feet),
                f'{hip:g}',
                f'{loop.frequency:.2f}',
                f'{loop.damping_ratio:+.3f}',
                f'{loop.growth:+.2f}',
            )
        )
    return Table(('feet', 'K_H', 'swing, Hz', 'damping ratio', 'growth, 1/s'), tuple(rows))


def _checks(plane: Plane) -> Columns[Point]:
    return {
        'force scale, mV/N': lambda row: f'{1e3 * row.setting.force_scale:g}',
        'time constant, s': lambda row: f'{row.setting.time_constant:g}',
        'K_H': lambda row: (
            f'{row.setting.hip_gain:g}' + ('' if row.setting.offset else ', the rate alone')
        ),
        f'limit, deg ({plane.engine})': lambda row: f'{plane.at(row.setting).limit_deg:.1f}',
        'limit, deg (the other)': lambda row: f'{row.limit_deg:.1f}',
    }


def _seeds(plane: Plane) -> str:
    return (
        f'{plane.runs} leg lifts, {len(plane.points[0].climbs)} seeds of each point; a limit is '
        f'found to a quarter of a degree.'
    )
