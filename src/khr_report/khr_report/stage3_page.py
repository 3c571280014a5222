"""``khr stage3``: what the hip's damping is worth to a standing robot, as page, data and picture."""

from __future__ import annotations

from math import degrees, isnan
from pathlib import Path

import numpy as np

from khr_common.files import write_text
from khr_experiments.json_file import read_json, write_json
from khr_figures.plot_style import styled
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
made of? The ankles' loop (3.13) has two constants that nothing published fixes, the scale of the
force sensors and their time constant. The plane of both, with K_A {ANKLE_GAIN:g}:"""
CAPTION = """*Left without the hip, right with it. Solid lines: the scale beyond which the robot falls on the
flat already; dotted: where the linear model expects it with the hip.*"""
MODEL = """`khr_analysis.models.force_loop` is the loop without dry friction, linear, with the board's
period and delay: three joints with their servos on a foot that stays flat, the low-passes of force
sensors and gyro. Its eigenvalues say that the ankles' loop swings at about 2 Hz as soon as it is
strong or fast, and that the rate fed back to the hips takes energy out of that swing. The robot bears
some growth, because dry friction takes energy as well. How much is one number, read off the edge
without the hip; the edge with the hip then is a prediction."""


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
    with styled():
        figure.savefig(picture, dpi=120, metadata={'Software': None})
    image = f'![Limits, overshoot and damping over the plane]({picture.name})'
    write_text(out, markdown([HEAD, image, CAPTION, *blocks(plane, found)]) + '\n')
    return summary(plane)


def summary(plane: Plane) -> str:
    """Say where the hip is worth most."""
    worth = plane.worth
    time, scale = np.unravel_index(int(np.argmax(worth)), worth.shape)
    near = plane.nearest
    return (
        f'the hip is worth {worth.max():.1f} deg at {_place(plane.scales[scale], plane.times[time])}'
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
    worth, without, with_hip = plane.worth, plane.limits(0.0), plane.limits(HIP_GAIN)
    held = worth >= WORTH
    toppled = held & (without == 0.0)
    text = (
        f'At {held.sum()} of {worth.size} points the hip raises the limit by {WORTH:g} deg or more. '
        f'At {toppled.sum()} of them the ankles alone topple the robot on the flat. '
    )
    if held.any():
        text += (
            f"All of them lie along the edge of the ankles' loop; there the limit with the hip is "
            f'{with_hip[held].min():.1f} to {with_hip[held].max():.1f} deg. '
        )
    calm = (without > 0.0) & ~held
    if calm.any():
        text += (
            f"At the {calm.sum()} points where the ankles' loop is calm by itself the hip adds "
            f'{worth[calm].mean():+.2f} deg on average: it has nothing to damp, and holds no lean.'
        )
    return text


def _thesis(plane: Plane) -> str:
    near = plane.nearest
    ankle, both = (
        plane.at(Setting(near.force_scale, near.time_constant, hip)).limit_deg
        for hip in (0.0, HIP_GAIN)
    )
    limits = (plane.without.limit_deg, ankle, both)
    all_in = all(
        abs(limit - thesis) <= WITHIN for limit, thesis in zip(limits, THESIS, strict=True)
    )
    return (
        f"The thesis's three limits, {THESIS[0]:g}, {THESIS[1]:g} and {THESIS[2]:g} deg, come out "
        f'nearest at {_place(near.force_scale, near.time_constant)}: {limits[0]:.1f}, '
        f'{limits[1]:.1f} and {limits[2]:.1f} deg; '
        + (
            f'each is within {WITHIN:g} deg.'
            if all_in
            else f'not each of them is within {WITHIN:g} deg.'
        )
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
    misses = [abs(measured - predicted) for measured, predicted in pairs]
    return (
        f'Without the hip the robot bears {np.mean(rates):.2f} 1/s, between {min(rates):.2f} and '
        f'{max(rates):.2f} over the time constants. With the hip the predicted edge misses the '
        f'measured one by {1e3 * max(misses):.2f} mV/N at most, in {len(pairs)} comparisons; '
        'an edge lies anywhere between two columns of the plane.'
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
    for hip in (0.0, HIP_GAIN):
        rows = (
            (f'{time:g}', *(cell(plane.at(Setting(scale, time, hip))) for scale in plane.scales))
            for time in plane.times
        )
        parts += [
            f'K_A {ANKLE_GAIN:g}, K_H {hip:g}:',
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
        'K_H': lambda row: f'{row.setting.hip_gain:g}',
        f'limit, deg ({plane.engine})': lambda row: f'{plane.at(row.setting).limit_deg:.1f}',
        'limit, deg (the other)': lambda row: f'{row.limit_deg:.1f}',
    }


def _seeds(plane: Plane) -> str:
    return (
        f'{plane.runs} leg lifts, {len(plane.points[0].climbs)} seeds of each point; a limit is '
        f'found to a quarter of a degree.'
    )
