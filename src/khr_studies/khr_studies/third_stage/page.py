"""The third stage of standing: page, data and plots."""

from __future__ import annotations

from math import degrees, isfinite, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np

from khr_balance.controllers import AnkleControllerParameters
from khr_common.files import write_text
from khr_report.page.document import Columns, grid, number, page_text, table
from khr_report.plots.plot_style import save
from khr_sim.sensors import FootForceParameters
from khr_studies.measuring.run_table import write_table
from khr_studies.third_stage import study
from khr_studies.third_stage.comparison import ModelComparison, ModelLoop
from khr_studies.third_stage.figure import limits_figure, swing_figure
from khr_studies.third_stage.study import HIP_GAIN, THESIS, WITHIN, WORTH, Plane


def write(plane: Plane, compared: ModelComparison, out: Path) -> str:
    """Write the page, with its plots and data in the same folder; return a summary of one line."""
    plots = out.with_suffix('.png'), out.with_name(f'{out.stem}_swing.png')
    write_table(plane.climbs, out.with_suffix('.csv'))
    for draw, path in zip((limits_figure, swing_figure), plots, strict=True):
        save(draw(plane, compared), path, dpi=200)
    write_text(out, page(plane, compared, *(path.name for path in plots)))
    return summary(plane)


def summary(plane: Plane) -> str:
    """Return where the hip's rate raises the limit most, and the point nearest the thesis."""
    worth = plane.worth
    time, scale = np.unravel_index(int(np.argmax(worth)), worth.shape)
    near = plane.nearest
    return (
        f"the hip's rate is worth {worth.max():.1f} deg at {_place(plane.scales[scale], plane.times[time])}"
        f'; nearest to the thesis: {_place(near.force_scale, near.time_constant)}'
    )


def page(plane: Plane, compared: ModelComparison, limits_plot: str, swing_plot: str) -> str:
    """Return the page; the plots are names of files in its folder."""
    worth, without, edges = plane.worth, plane.limits(0.0), compared.edges
    held, near = worth >= WORTH, plane.nearest
    row, column = plane.times.index(near.time_constant), plane.scales.index(near.force_scale)
    limits = (plane.uncontrolled_deg, without[row, column], plane.limits(HIP_GAIN)[row, column])
    checks = plane.checks
    at_near = (checks['force_scale'] == near.force_scale) & (
        checks['time_constant'] == near.time_constant
    )
    moved = edges[['with_hip', 'predicted']].sub(edges['without_hip'], axis=0).dropna()
    distances = [plane.columns_off(plane.times[i], plane.scales[j]) for i, j in np.argwhere(held)]
    return page_text(
        __name__,
        plane=plane,
        limits_plot=limits_plot,
        swing_plot=swing_plot,
        study=study,
        held=held,
        others=(without > 0.0) & ~held,
        toppled=(held & (without == 0.0)).sum(),
        columns_off=[off for off in distances if isfinite(off)],
        with_rate=plane.limits(HIP_GAIN),
        worth=worth,
        nearest=_place(near.force_scale, near.time_constant),
        default=_place(AnkleControllerParameters.force_scale, FootForceParameters.time_constant),
        limits=limits,
        met=all(abs(limit - own) <= WITHIN for limit, own in zip(limits, THESIS, strict=True)),
        checked=checks[at_near]['other_deg'].tolist(),
        edges=table(edges.to_dict('records'), EDGES),
        rates=edges['growth'].dropna().tolist(),
        moved=moved.mean().tolist() if len(moved) else (nan, nan),
        misses=(edges['with_hip'] - edges['predicted']).abs().dropna().tolist(),
        grids=[(f'K_H {hip:g}', _grid(plane, hip)) for hip in (0.0, HIP_GAIN)],
        loops=table(compared.loops, LOOPS),
        checks=table(checks.to_dict('records'), _checks(plane)),
        seeds=plane.points['seed'].nunique(),
    )


def _place(scale: float, time: float) -> str:
    return f'{1e3 * scale:g} mV/N and {time:g} s'


def _number(value: float) -> str:
    return number(None if isnan(value) else value, 2)


EDGES: Columns[dict[str, Any]] = {
    'time constant, s': lambda row: f'{row["time_constant"]:g}',
    'edge without the hip, mV/N': lambda row: _number(1e3 * row['without_hip']),
    "model's growth there, 1/s": lambda row: _number(row['growth']),
    'edge with the hip, mV/N': lambda row: _number(1e3 * row['with_hip']),
    'predicted, mV/N': lambda row: _number(1e3 * row['predicted']),
}
LOOPS: Columns[ModelLoop] = {
    'feet': lambda row: str(row.feet),
    'K_H': lambda row: f'{row.hip_gain:g}',
    'swing, Hz': lambda row: f'{row.model.frequency:.2f}',
    'damping ratio': lambda row: f'{row.model.damping_ratio:+.3f}',
    'growth, 1/s': lambda row: f'{row.model.growth:+.2f}',
}


def _checks(plane: Plane) -> Columns[dict[str, Any]]:
    return {
        'force scale, mV/N': lambda row: f'{1e3 * row["force_scale"]:g}',
        'time constant, s': lambda row: f'{row["time_constant"]:g}',
        'K_H': lambda row: f'{row["hip_gain"]:g}',
        f'limit, deg ({plane.engine})': lambda row: f'{row["limit_deg"]:.1f}',
        'limit, deg (the other)': lambda row: f'{row["other_deg"]:.1f}',
    }


def _grid(plane: Plane, hip_gain: float) -> str:
    """Return limits and overshoots over the plane with a hip gain."""
    limits = plane.limits(hip_gain)
    rates = plane.grid('overshoot_rad_s', hip_gain).to_numpy()

    def cell(limit: float, rate: float) -> str:
        return f'{limit:.1f} ({"-" if isnan(rate) else f"{degrees(rate):.0f}"})'

    return grid(
        ['', *(f'{1e3 * scale:g}' for scale in plane.scales)],
        [
            [f'{time:g}', *map(cell, *values)]
            for time, *values in zip(plane.times, limits, rates, strict=True)
        ],
    )
