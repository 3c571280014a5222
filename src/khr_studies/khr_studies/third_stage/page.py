"""What the hip's damping is worth to a standing robot: page, data and picture."""

from __future__ import annotations

from math import degrees, isfinite, isnan, nan
from pathlib import Path

import numpy as np

from khr_common.files import write_text
from khr_report.page.document import Columns, Table, number, table
from khr_report.page.template import page_text
from khr_report.plots.plot_style import save
from khr_studies.measuring.json_file import write_json
from khr_studies.third_stage.comparison import Edge, ModelComparison, ModelLoop
from khr_studies.third_stage.figure import limits_picture, swing_picture
from khr_studies.third_stage.study import (
    ANKLE_GAIN,
    HIP_GAIN,
    THESIS,
    WITHIN,
    WORTH,
    Plane,
    Point,
    Setting,
)


def write(plane: Plane, compared: ModelComparison, out: Path) -> str:
    """Write page, picture and data beside one another; return a summary of one line.

    Raises:
        KhrError, RunError, OSError: if a file cannot be written.
    """
    pictures = out.with_suffix('.png'), out.with_name(f'{out.stem}_swing.png')
    write_json(out.with_suffix('.json'), plane)
    for draw, picture in zip((limits_picture, swing_picture), pictures, strict=True):
        save(draw(plane, compared), picture, dpi=200)
    write_text(out, page(plane, compared, *(picture.name for picture in pictures)))
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


def page(plane: Plane, compared: ModelComparison, limits_picture: str, swing_picture: str) -> str:
    """Return the page; the pictures are files beside it."""
    found = compared.edges
    near, worth, without = plane.nearest, plane.worth, plane.limits(0.0)
    held = worth >= WORTH
    pair = [Setting(near.force_scale, near.time_constant, hip) for hip in (0.0, HIP_GAIN)]
    limits = (plane.without.limit_deg, *(plane.at(each).limit_deg for each in pair))
    moved = [
        (e.with_hip - e.without_hip, e.predicted - e.without_hip)
        for e in found
        if e.with_hip and e.predicted and e.without_hip
    ]
    distances = [
        plane.columns_off(plane.times[row], plane.scales[column])
        for row, column in np.argwhere(held)
    ]
    return page_text(
        __name__,
        plane=plane,
        limits_picture=limits_picture,
        swing_picture=swing_picture,
        thesis=THESIS,
        ankle_gain=ANKLE_GAIN,
        least=WORTH,
        within=WITHIN,
        held=held,
        others=(without > 0.0) & ~held,
        toppled=(held & (without == 0.0)).sum(),
        columns_off=[off for off in distances if isfinite(off)],
        with_rate=plane.limits(HIP_GAIN, offset=False),
        worth=worth,
        offset=plane.worth_of_offset,
        nearest=_place(near.force_scale, near.time_constant),
        limits=limits,
        met=all(abs(limit - own) <= WITHIN for limit, own in zip(limits, THESIS, strict=True)),
        checked=[point.limit_deg for point in plane.checks if point.setting in pair],
        edges=table(found, EDGES),
        rates=[edge.growth for edge in found if edge.growth is not None],
        moved=np.mean(moved, axis=0) if moved else (nan, nan),
        misses=[abs(e.with_hip - e.predicted) for e in found if e.with_hip and e.predicted],
        grids=_grids(plane),
        loops=table(compared.loops, LOOPS),
        checks=table(plane.checks, _checks(plane)),
    )


def _place(scale: float, time: float) -> str:
    return f'{1e3 * scale:g} mV/N and {time:g} s'


def _scale(value: float | None) -> str:
    return number(None if value is None else 1e3 * value, 2)


EDGES: Columns[Edge] = {
    'time constant, s': lambda row: f'{row.time_constant:g}',
    'edge without the hip, mV/N': lambda row: _scale(row.without_hip),
    "model's growth there, 1/s": lambda row: number(row.growth, 2),
    'edge with the hip, mV/N': lambda row: _scale(row.with_hip),
    'predicted, mV/N': lambda row: _scale(row.predicted),
}


def _grids(plane: Plane) -> list[tuple[str, Table]]:
    """Return the limits over the plane, by the part of the hip in them."""

    def cell(point: Point) -> str:
        rate = '-' if isnan(point.overshoot) else f'{degrees(point.overshoot):.0f}'
        return f'{point.limit_deg:.1f} ({rate})'

    def grid(hip: float, offset: bool) -> Table:
        cells = zip(plane.times, plane.grid(hip, cell, offset), strict=True)
        head = ('', *(f'{1e3 * scale:g}' for scale in plane.scales))
        return Table(head, tuple((f'{time:g}', *row) for time, row in cells))

    return [
        ('K_H 0', grid(0.0, True)),
        (f'K_H {HIP_GAIN:g}, the rate alone', grid(HIP_GAIN, False)),
        (f'K_H {HIP_GAIN:g}, with the offset', grid(HIP_GAIN, True)),
    ]


LOOPS: Columns[ModelLoop] = {
    'feet': lambda row: str(row.feet),
    'K_H': lambda row: f'{row.hip_gain:g}',
    'swing, Hz': lambda row: f'{row.model.frequency:.2f}',
    'damping ratio': lambda row: f'{row.model.damping_ratio:+.3f}',
    'growth, 1/s': lambda row: f'{row.model.growth:+.2f}',
}


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
