"""The largest pushes of robot and models as CSV and Markdown.

``python -m khr_studies.push.page docs/models.md`` writes them into the models' document; it takes
a few minutes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from khr_common import markdown
from khr_common.files import write_text
from khr_common.markdown import WrittenPart
from khr_report.page.document import page_text
from khr_sim.parameters import SimulatorParameters
from khr_studies.push import study
from khr_studies.push.limits import (
    DURATIONS,
    IMPULSE,
    PADS,
    SHORT,
    compliance,
    conditions,
    momentum,
    push_table,
)
from khr_studies.push.motions import legs
from khr_studies.push.study import stance
from khr_sweeps.trial import Row

MOMENTUM_COLUMNS = {
    'push, s': '{duration:g}',
    'robot, N s': '{survived:.3f} to {fatal:.3f}',
    'point mass, N s': '{point_mass:.3f}',
    'rigid body, N s': '{rigid_body:.3f}',
    f'COM carried by {IMPULSE:g} N s': '{moved_mm:.1f} mm',
}
COMPLIANCE_COLUMNS = {
    'push, s': '{duration:g}',
    'robot, N': '{robot:.2f}',
    'with stiff servos, N': '{stiff_robot:.2f}',
    'rigid, closed form, N': '{rigid:.2f}',
    'model of its body, N': '{model:.2f}',
    'with a stiff servo, N': '{stiff_model:.2f}',
    'rigid, m l^2 as the model, closed form, N': '{rigid_model:.2f}',
}
MODELS = {
    'model of its body, published': 'published_robot',
    "thesis's model, physical": 'physical_thesis',
    "thesis's model, published": 'published_thesis',
}


def largest_pushes(table: pd.DataFrame) -> str:
    """Return a table with a line per duration and body, and a column per loop."""
    rows = {
        (row.direction, row.duration, row.gain and row.gyro, row.gain): row
        for row in table.itertuples()
    }
    loops = sorted({key[2:] for key in rows}, key=lambda loop: (loop[0] == 'circuit', loop[1]))
    directions = list(dict.fromkeys(table['direction']))
    bodies: list[tuple[str, str, tuple[str, ...]]] = []
    for side in directions:
        source = study.SOURCES[side]
        bodies.append((f'robot, from {source}', side, ('survived', 'fatal')))
        bodies.append((f'model of its body, from {source}', side, ('physical_robot',)))
    # These models survive as much from both sides.
    bodies += [(name, directions[0], (force,)) for name, force in MODELS.items()]
    lines = [
        [
            f'{duration:g} s',
            name,
            *(
                ' to '.join(
                    f'{getattr(rows[side, duration, *loop], force):.2f}' for force in forces
                )
                for loop in loops
            ),
        ]
        for duration in dict.fromkeys(table['duration'])
        for name, side, forces in bodies
    ]
    head = [f'K_A = {gain:g}' + (f', {gyro}' if gyro else '') for gyro, gain in loops]
    return markdown.table(['push', 'body', *head], lines)


def document_part() -> str:
    """Measure, and return the part of the models' document on the robot; it takes minutes."""
    own = stance()
    body, inertia = own.tipping('behind')
    moved = [momentum(duration) for duration in SHORT]
    on_pads = conditions(durations=DURATIONS[:1], gyros=('packaged',), changes=PADS)
    return page_text(
        __name__,
        body=body,
        heels=own.tipping('front')[0].half_foot,
        inertia=inertia / body.edge_inertia,
        servo=legs(own, SimulatorParameters()),
        pad_distance=SimulatorParameters().pad_distance,
        study=study,
        pushes=largest_pushes(push_table(conditions())),
        on_pads=largest_pushes(push_table(on_pads)),
        momentum=_table(moved, MOMENTUM_COLUMNS),
        weakest=min(moved, key=lambda row: float(row['survived']))['duration'],
        compliance=_table([compliance(duration) for duration in DURATIONS], COMPLIANCE_COLUMNS),
    ).strip()


def _table(rows: Sequence[Row], columns: dict[str, str]) -> str:
    """Return a table of formatted columns; a number that is NaN means that the robot falls."""
    cells = [[form.format(**row) for form in columns.values()] for row in rows]
    shown = [['falls' if 'nan' in cell else cell for cell in line] for line in cells]
    return markdown.table(list(columns), shown)


def write(table: pd.DataFrame, out: Path) -> list[Path]:
    """Write push.csv and push.md into a folder; return their paths."""
    texts = {
        out / 'push.csv': table.to_csv(index=False, float_format='%.4g', lineterminator='\n'),
        out / 'push.md': largest_pushes(table) + '\n',
    }
    for path, text in texts.items():
        write_text(path, text)
    return list(texts)


PART = WrittenPart('khr_studies.push.page docs/models.md', document_part)

if __name__ == '__main__':
    # by the module's own name, at which its template is
    from khr_studies.push import page

    page.PART.main()
