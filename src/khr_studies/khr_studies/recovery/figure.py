"""Plot of oblique pushes: the largest impulse by its direction."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from khr_report.plots.plot_style import head, styled
from khr_studies.recovery.study import held

LOOKS = {False: ('ankles alone', '#0072B2', '--'), True: ('with the step', '#D55E00', '-')}


def polar_figure(runs: pd.DataFrame) -> Figure:
    """Draw the impulse that is held by the direction in which it pushes; holes are crosses."""
    with styled():
        figure = Figure(figsize=(5.0, 5.0), layout='constrained')
        axis: Any = figure.add_subplot(projection='polar')
        axis.set_theta_zero_location('N')
        for recovery, (name, color, dash) in LOOKS.items():
            own = runs[runs['recovery'].astype(bool) == recovery]
            found = {float(angle): held(each, 'impulse') for angle, each in own.groupby('angle')}
            angles = np.radians([*found, next(iter(found))])
            impulses = [impulse for impulse, _ in found.values()]
            axis.plot(angles, [*impulses, impulses[0]], color=color, linestyle=dash, label=name)
            holes = [
                (np.radians(angle), hole) for angle, (_, all_) in found.items() for hole in all_
            ]
            if holes:
                axis.plot(*zip(*holes, strict=True), 'x', color=color, label=f'{name}: holes')
        axis.set_rlabel_position(22.5)
        axis.set_thetagrids(
            range(0, 360, 45),
            [
                'pushed forward',
                '45°',
                'to the left',
                '135°',
                'backward',
                '225°',
                'to the right',
                '315°',
            ],
        )
        figure.legend(loc='outside lower center', ncols=2)
        head(figure, 'Largest impulse held by its direction (N s)')
        return figure
