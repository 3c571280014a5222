"""The parameters that a search may vary: gains, and the placement of the centre of mass."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from khr_bringup.node_registry import table_of
from khr_bringup.scenario.scenario import Scenario

Changes = dict[tuple[str, str], Any]


@dataclass(frozen=True)
class GainAxis:
    """One parameter of the search."""

    # node, key: of the parameter
    node: str
    key: str
    # low, high: ends of the range
    low: float
    high: float
    step: float  # values are rounded to multiples of it
    symbol: str  # label in pictures and tables

    @property
    def name(self) -> str:
        """Return ``node.key``."""
        return f'{self.node}.{self.key}'

    @property
    def is_gain(self) -> bool:
        """Return whether it is a gain; its value 0 switches the controller off."""
        return self.key == 'gain'

    def at(self, share: float) -> float:
        """Return the rounded value at a share of the range, 0 to 1."""
        value = self.low + min(max(share, 0.0), 1.0) * (self.high - self.low)
        return round(round(value / self.step) * self.step, 6)

    def share(self, value: float) -> float:
        """Return the position of a value in the range, 0 to 1."""
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)

    def value_in(self, scenario: Scenario) -> float:
        """Return the value in a scenario; 0 for the gain of a controller that is off."""
        table = scenario.table(table_of(self.node))
        return 0.0 if self.is_gain and not table.enabled else float(getattr(table, self.key))


GAINS = (
    GainAxis('ankle_controller', 'gain', 0.0, 36.0, 0.5, 'K_A'),
    GainAxis('hip_controller', 'gain', 0.0, 24.0, 0.5, 'K_H'),
)
PLACEMENT = (
    GainAxis('gait', 'com_lifted', 0.0, 0.025, 0.0005, 'com_lifted'),
    GainAxis('gait', 'com_touchdown', 0.01, 0.04, 0.0005, 'com_touchdown'),
    GainAxis('gait', 'torso_pitch', 0.0, 0.15, 0.005, 'torso_pitch'),
)


def parameter_changes(axes: Iterable[GainAxis], values: Sequence[float]) -> Changes:
    """Return the parameters of a candidate by (node, key)."""
    found: Changes = {}
    for axis, value in zip(axes, values, strict=True):
        found[axis.node, axis.key] = value
        if axis.is_gain:
            found[axis.node, 'enabled'] = value > 0.0
    return found
