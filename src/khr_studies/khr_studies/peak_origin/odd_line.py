"""What raises the line at 4.74 Hz, line 11 of the gait's cycle: the experiment ``line_11``.

The halves of the gait's cycle are mirror images, and a mirrored motion has the same pitch. A robot
whose left and right are alike therefore has lines of even number alone; an odd one takes a robot,
or a walk, whose halves differ.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from khr_studies.errors import StudyError
from khr_studies.measuring.experiments import Runs, group_by
from khr_studies.peak_origin.cycle_spectrum import Walks
from khr_studies.peak_origin.study import walks_of
from khr_sweeps.axes import CASE

EXPERIMENT = 'line_11'
NUMBER = 11  # of the line: 4.76 Hz
LISTED = 4  # lines of a spectrum that the thesis lists


@dataclass(frozen=True)
class OddLine:
    """Line 11 in the walks of one case.

    Attributes:
        case: what was changed.
        runs: how many there were; those that stayed up have an amplitude.
        frequency: of the line, Hz.
        amplitudes: of the line in each walk, rad/s.
        shares: over the largest line of the same walk.
        among: walks in which it is among the four largest lines.
        odd: amplitude of all odd lines over that of all even ones, root of their squares' sums.
    """

    case: str
    runs: int
    frequency: float
    amplitudes: tuple[float, ...]
    shares: tuple[float, ...]
    among: int
    odd: float


def odd_lines(runs: Mapping[str, Runs]) -> tuple[OddLine, ...]:
    """Measure line 11 in each case of the experiment, in its order.

    Args:
        runs: by experiment; those of ``line_11``.

    Raises:
        StudyError: if no walk stayed up.
    """
    done = runs[EXPERIMENT]
    if not done:
        raise StudyError(f'{EXPERIMENT}: 0 runs are not accepted; accepted: finished runs')
    tried = {
        str(case): len(some) for case, some in group_by(done, lambda run: run.point[CASE]).items()
    }
    return tuple(_measured(walks, tried[walks.label]) for walks in walks_of(done))


def _measured(walks: Walks, tried: int) -> OddLine:
    lines = walks.amplitudes[:, walks.cycles :: walks.cycles]  # of numbers 1, 2, ...
    own = lines[:, NUMBER - 1]
    odd, even = np.sum(lines[:, 0::2] ** 2), np.sum(lines[:, 1::2] ** 2)
    return OddLine(
        walks.label,
        tried,
        NUMBER / walks.treatment.cycle_period,
        tuple(own.tolist()),
        tuple((own / lines.max(axis=1)).tolist()),
        int(np.sum(np.sum(lines > own[:, None], axis=1) < LISTED)),
        float(np.sqrt(odd / even)),
    )
