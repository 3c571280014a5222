"""What can be changed on the page: parameters of the running nodes, as their descriptors say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Value = bool | float


@dataclass(frozen=True)
class Tunable:
    """A parameter that the page lets the reader change.

    Attributes:
        group: under which heading.
        node, name: of the parameter.
        label: what the page calls it.
        step: of its slider.
        most: where the slider ends, if the parameter accepts more than a slider can show.
    """

    group: str
    node: str
    name: str
    label: str
    step: float = 0.1
    most: float = float('inf')

    @property
    def key(self) -> tuple[str, str]:
        """Return node and parameter."""
        return self.node, self.name


TUNABLES = (
    Tunable('Feedback', 'ankle_controller', 'enabled', 'Ankle control'),
    Tunable('Feedback', 'ankle_controller', 'gain', 'Ankle gain K_A', 0.5),
    Tunable('Feedback', 'hip_controller', 'enabled', 'Hip control'),
    Tunable('Feedback', 'hip_controller', 'gain', 'Hip gain K_H', 0.5),
    Tunable('Ground', 'simulator', 'inclination_deg', 'Inclination'),
    Tunable('Ground', 'simulator', 'friction', 'Friction', 0.01),
    Tunable('Time', 'simulator', 'pace', 'Pace', 0.05, 5.0),
    Tunable('Time', 'simulator', 'realtime_factor', 'Realtime factor', 0.05, 5.0),
)


# What the page has to know to draw, and does not let the reader change.
WATCHED = (
    Tunable('', 'simulator', 'surface', ''),
    Tunable('', 'simulator', 'pad_distance', ''),
    Tunable('', 'fft_analyser', 'fundamental', ''),
    Tunable('', 'recorder', 'scenario_file', ''),
)


@dataclass(frozen=True)
class Control:
    """A checkbox or a slider for a parameter of a live node.

    Attributes:
        tunable: which parameter.
        value: that it has.
        hint: its meaning and what it accepts.
        unit: of its value.
        minimum, maximum: of its slider; None for a checkbox.
    """

    tunable: Tunable
    value: Value
    hint: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None

    @property
    def label(self) -> str:
        """Return the label with its unit."""
        return f'{self.tunable.label}, {self.unit}' if self.unit else self.tunable.label


def control(tunable: Tunable, descriptor: Any, value: Any) -> Control | None:
    """Return the control of a parameter, or None if there is nothing to change.

    Args:
        tunable: the parameter.
        descriptor: a rcl_interfaces/ParameterDescriptor.
        value: that the parameter has.
    """
    if descriptor.read_only:
        return None
    meaning, _, unit = descriptor.description.partition(' [')
    hint, unit = f'{meaning} {descriptor.additional_constraints}'.strip(), unit.rstrip(']')
    if isinstance(value, bool):
        return Control(tunable, value, hint, unit)
    if not isinstance(value, float) or not descriptor.floating_point_range:
        return None
    accepted = descriptor.floating_point_range[0]
    most = max(min(accepted.to_value, tunable.most), value)
    return Control(tunable, value, hint, unit, accepted.from_value, most)


class Pending:
    """What has been asked of the nodes: one request per parameter at a time, the newest value next.

    A slider that is dragged asks faster than a node answers. What it asked for on the way does not
    come back to it as a change by someone else, or it would jump under the reader's hand.
    """

    def __init__(self) -> None:
        self._next: dict[tuple[str, str], Value] = {}
        self._sent: dict[tuple[str, str], Value] = {}

    def ask(self, key: tuple[str, str], value: Value) -> None:
        """Note the newest value that the reader wants."""
        self._next[key] = value

    def due(self) -> Mapping[tuple[str, str], Value]:
        """Return what to send now, and count it as sent."""
        ready = {key: value for key, value in self._next.items() if key not in self._sent}
        self._sent |= ready
        self._next = {key: value for key, value in self._next.items() if key not in ready}
        return ready

    def answered(self, key: tuple[str, str]) -> None:
        """Note that a node has answered."""
        self._sent.pop(key, None)

    def __contains__(self, key: object) -> bool:
        return key in self._next or key in self._sent
