"""The causes of the line at 4.74 Hz, line 11 of the gait's cycle: the experiment ``line_11``.

The halves of the gait's cycle are mirror images, and a mirrored motion has the same pitch. So a
symmetric robot has lines of even number only; an odd line needs a robot or a walk with unlike
halves.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from khr_common.errors import KhrError
from khr_studies.measuring.experiments import Runs
from khr_studies.peak_origin.cycle_spectrum import Walks
from khr_studies.peak_origin.study import walks_of
from khr_sweeps.axes import CASE
from khr_sweeps.trial import Row

EXPERIMENT = 'line_11'
NUMBER = 11  # of the line: 4.76 Hz
LISTED = 4  # largest lines of a spectrum that the thesis lists


def measure_line_11(runs: Mapping[str, Runs]) -> list[Row]:
    """Measure line 11 in each case of the experiment, in its order.

    Args:
        runs: by experiment, at least those of ``line_11``.

    Returns:
        A row per case with its name ``case``, the number of ``runs``, the ``frequency`` of the
        line, Hz, and for the walks that stayed up the ``amplitudes`` of the line, rad/s, their
        ``shares`` of the largest line, the number of walks in which it is ``among`` the four
        largest lines, and the root-sum-square ratio of ``odd`` over even lines.

    Raises:
        KhrError: if no walk stayed up.
    """
    done = runs[EXPERIMENT]
    if not done:
        raise KhrError(f'{EXPERIMENT}: 0 runs are not accepted; accepted: finished runs')
    counts = Counter(run.point[CASE] for run in done)
    return [
        {'case': walks.label, 'runs': counts[walks.label], **_lines(walks)}
        for walks in walks_of(done)
    ]


def _lines(walks: Walks) -> Row:
    lines = walks.amplitudes[:, walks.cycles :: walks.cycles]  # of numbers 1, 2, ...
    own = lines[:, NUMBER - 1]
    odd, even = np.sum(lines[:, 0::2] ** 2), np.sum(lines[:, 1::2] ** 2)
    return {
        'frequency': NUMBER / walks.treatment.cycle_period,
        'amplitudes': own.tolist(),
        'shares': (own / lines.max(axis=1)).tolist(),
        'among': int(np.sum(np.sum(lines > own[:, None], axis=1) < LISTED)),
        'odd': float(np.sqrt(odd / even)),
    }
