"""What a calibration searches: free constants with range and source, and the rows they shall meet.

Both stand in a file, ``config/calibration.yaml``. A constant holds for every scenario; nothing is
fitted per scenario.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from math import exp, isfinite, log
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked

from khr_bringup.node_registry import table_of
from khr_bringup.scenario import CONFIG
from khr_bringup.strict_yaml import read_file, read_yaml
from khr_common import KhrError, check, specifications
from khr_experiments.condition import Changes, Condition
from khr_experiments.errors import ExperimentError

SHIPPED_PLAN = CONFIG / 'calibration.yaml'
DIGITS = 4  # significant ones of a constant
Origin = Literal['free', 'published', 'derived']
Use = Literal['fitted', 'held back']
Positive = Annotated[float, Field(gt=0.0)]
STRICT = ConfigDict(extra='forbid')


@checked(frozen=True, config=STRICT)
class FreeConstant:
    """A constant that the search may move.

    Attributes:
        parameters: that hold it, each ``node.key``.
        range: ends of the search.
        source: of the range, in words.
        origin: ``free`` if nobody has published it; else of the value that it would have.
        value: that published or derived value, or range of values.
        logarithmic: whether equal ratios count as equal steps.
    """

    parameters: tuple[str, ...]
    range: tuple[float, float]
    source: str
    origin: Origin = 'free'
    value: tuple[float, float] | None = None
    logarithmic: bool = False

    def at(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1, rounded."""
        low, high = self.range
        if self.logarithmic:
            value = exp(log(low) + share * (log(high) - log(low)))
        else:
            value = low + share * (high - low)
        return float(f'{min(max(value, low), high):.{DIGITS}g}')

    def share(self, value: float) -> float:
        """Return at which share of the range a value is."""
        low, high = self.range
        if self.logarithmic:
            return (log(value) - log(low)) / (log(high) - log(low))
        return (value - low) / (high - low)

    def away(self, value: float) -> bool:
        """Return whether a value is away from what is published or derived."""
        return self.value is not None and not self.value[0] <= value <= self.value[1]

    @property
    def default(self) -> float:
        """Return the default of its parameters."""
        node, key = self.parameters[0].split('.')
        value = specifications(table_of(node))[key].default
        assert isinstance(value, float)
        return value

    @property
    def unit(self) -> str:
        """Return the unit of its parameters."""
        node, key = self.parameters[0].split('.')
        return specifications(table_of(node))[key].unit


@checked(frozen=True, config=STRICT)
class WantedLimit:
    """A critical inclination of the thesis.

    Attributes:
        motion, ka, kh, surface: the condition.
        thesis_deg: the critical inclination published.
        aim_deg: what the search aims at: on the thesis's steepest ground the robot still walked.
        tolerance_deg: within which a limit fits.
        weight: in the cost.
        use: whether the search knows the row.
    """

    motion: Literal['walk', 'leg_lift']
    thesis_deg: float
    aim_deg: float
    ka: float = 0.0
    kh: float = 0.0
    surface: Literal['smooth', 'rubber'] = 'smooth'
    tolerance_deg: Positive = 0.7
    weight: Positive = 1.0
    use: Use = 'fitted'

    @property
    def condition(self) -> Condition:
        """Return what is measured."""
        return Condition(self.motion, self.ka, self.kh, self.surface)


@checked(frozen=True, config=STRICT)
class WantedWalk:
    """A walk that must not fall, and may have to slip.

    Attributes:
        inclination_deg, ka, kh: the walk.
        cycles: of the gait.
        slip_mm: range of the largest slip.
        weight: in the cost.
    """

    inclination_deg: float
    ka: float = 0.0
    kh: float = 0.0
    cycles: int = 4
    slip_mm: tuple[float, float] = (0.0, 56.0)
    weight: Positive = 1.0

    @property
    def title(self) -> str:
        """Name the row."""
        return f'{self.condition.title}, {self.inclination_deg:g} deg, {self.cycles} cycles'

    @property
    def condition(self) -> Condition:
        """Return what is measured."""
        return Condition('walk', self.ka, self.kh, changes=((('gait', 'cycles'), self.cycles),))


@checked(frozen=True, config=STRICT)
class CalibrationPlan:
    """The whole of a calibration.

    Attributes:
        constants: by name.
        limits, walks: the rows, those that reject bad candidates first.
        placed: candidates placed by hand, which are measured first; each states every constant.
    """

    constants: dict[str, FreeConstant]
    limits: tuple[WantedLimit, ...]
    walks: tuple[WantedWalk, ...] = ()
    placed: tuple[dict[str, float], ...] = ()

    @property
    def fitted(self) -> tuple[WantedLimit, ...]:
        """Return the limits that the search knows."""
        return tuple(row for row in self.limits if row.use == 'fitted')

    def changes(self, constants: Mapping[str, float]) -> Changes:
        """Return the parameters that hold the constants."""
        return tuple(
            (_parameter(parameter), value)
            for name, value in constants.items()
            for parameter in self.constants[name].parameters
        )

    @property
    def defaults(self) -> dict[str, float]:
        """Return the constants as the parameter tables hold them."""
        return {name: constant.default for name, constant in self.constants.items()}

    @property
    def digest(self) -> str:
        """Return a digest of all that decides a search."""
        text = json.dumps(
            TypeAdapter(CalibrationPlan).dump_python(self, mode='json'), sort_keys=True
        )
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def read_plan(path: Path = SHIPPED_PLAN) -> CalibrationPlan:
    """Read a plan.

    Raises:
        KhrError: if it does not read; the text names file, place and what is accepted.
    """
    document = read_yaml(read_file(path), str(path))
    try:
        plan = TypeAdapter(CalibrationPlan).validate_python(document)
    except ValidationError as error:
        first = error.errors()[0]
        place = '.'.join(map(str, first['loc'])) or 'the file'
        raise ExperimentError(
            f'{path}: {place}: {first["msg"]}; accepted: constants, limits and walks as in the '
            'shipped config/calibration.yaml'
        ) from error
    if not plan.constants or not plan.fitted:
        raise ExperimentError(f'{path}: accepted: at least one constant and one fitted limit')
    for number, candidate in enumerate(plan.placed):
        if set(candidate) != set(plan.constants):
            raise ExperimentError(
                f'{path}: placed.{number}: {", ".join(candidate)} are not accepted; '
                f'accepted: {", ".join(plan.constants)}'
            )
    for name, constant in plan.constants.items():
        _check_constant(f'{path}: {name}', constant)
    return plan


def _check_constant(place: str, constant: FreeConstant) -> None:
    low, high = constant.range
    if not (isfinite(low) and isfinite(high) and low < high):
        raise ExperimentError(
            f'{place}: range: {constant.range} is not accepted; accepted: rising'
        )
    if constant.logarithmic and low <= 0.0:
        raise ExperimentError(f'{place}: range: {constant.range} is not accepted; accepted: > 0')
    for parameter in constant.parameters:
        try:
            node, key = _parameter(parameter)
            for value in constant.range:
                check(table_of(node), key, value)
        except (KhrError, KeyError, ValueError) as error:
            raise ExperimentError(f'{place}: {parameter}: {error}') from error


def _parameter(text: str) -> tuple[str, str]:
    node, key = text.split('.')
    return node, key
