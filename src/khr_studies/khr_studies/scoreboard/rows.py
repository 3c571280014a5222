"""The scoreboard as data: a record for each comparison of robot and thesis.

Every record has the ``chapter`` of the thesis, a ``kind`` and a ``verdict``. A value that could not
be measured is None. The functions that make the records document their other keys.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any, Literal

from khr_studies.measuring.run_table import Records
from khr_sweeps.trial import Row

# Fitted: the calibration used the row. Statics: it holds for any body that stands on a slope.
Kind = Literal['fitted', 'predicted', 'formula', 'statics']
VERDICTS = ('passed', 'missed', 'undecided', 'unpublished')
ENOUGH = 2  # seeds; one seed does not decide a row that varies with the seeds


@dataclass(frozen=True)
class Scoreboard:
    """All comparisons with the thesis."""

    seeds: int  # of each measurement
    # limits, orders, standing, walks, trends: records by section of the page
    limits: Records
    orders: Records
    standing: Records
    walks: Records
    trends: Records
    # effects of single changes on the limits that miss; None if not measured
    explanations: Records | None = None
    widths: Records = ()  # limits facing downhill and uphill
    # slide per step at which a walk counts as slipping; None if not measured
    slips_from_mm: float | None = None
    # physics engine of the measurements, and the other one, which repeats the limits
    engines: tuple[str, ...] = ()
    robot: str = ''  # whose constants; the default one if empty

    @property
    def rows(self) -> Records:
        """Return the records of all comparisons in the order of the page."""
        return [*self.limits, *self.orders, *self.standing, *self.walks, *self.trends]


def row(chapter: int, kind: Kind, passed: bool | None, **columns: Any) -> Row:
    """Return the record of a comparison.

    Args:
        passed: whether the robot agrees with the thesis; None if the measurement leaves it open.
        columns: of the section; numbers that are not finite become None.
    """
    verdict = {True: 'passed', False: 'missed', None: 'undecided'}[passed]
    plain = {name: _plain(value) for name, value in columns.items()}
    return {'chapter': chapter, 'kind': kind, 'verdict': verdict, **plain}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def kind_of(fitted: bool) -> Kind:
    """Return the kind of a row by whether the calibration used it."""
    return 'fitted' if fitted else 'predicted'


def grows(values: Sequence[float], least: float = 0.0) -> bool:
    """Return whether each value exceeds the one before by more than ``least``; False with NaN."""
    return all(later - earlier > least for earlier, later in pairwise(values))
