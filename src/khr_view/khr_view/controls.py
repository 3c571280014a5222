"""The parameters that the page can change, with the ranges of their descriptors."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.node_registry import controllers, short_name, table_of
from khr_common import specifications
from khr_common.interfaces import full_name
from khr_sim.run_parameters import GAIT

Value = bool | float


@dataclass(frozen=True)
class Tunable:
    """A parameter that the page lets the reader change."""

    group: str  # heading of its controls
    # node, name: of the parameter
    node: str
    name: str
    label: str  # on the page
    step: float = 0.1  # of its slider
    most: float = float('inf')  # end of the slider, if below the largest accepted value
    robot: str = ''  # in a bout, that has the node; the simulator has none

    @property
    def place(self) -> str:
        """Return the node with the namespace of its robot."""
        return full_name(self.robot, self.node)

    @property
    def key(self) -> tuple[str, str]:
        """Return node, with its robot, and parameter."""
        return self.place, self.name


SYMBOLS = {'ankle': ' K_A', 'hip': ' K_H'}  # of the gains that have one
SPEED = 'Speed, times real time'
_OF_SIMULATOR = (
    Tunable('Ground', 'simulator', 'inclination_deg', 'Inclination'),
    Tunable('Ground', 'simulator', 'friction', "Friction (0: the surface's own)", 0.01),
    Tunable('Time', 'simulator', 'pace', SPEED, 0.05, 5.0),
    Tunable('Time', 'simulator', 'realtime_factor', SPEED, 0.05, 5.0),
)

OF_CONTROLLER = ('enabled', 'gain')  # parameters that the reader can change
# Parameters that the page needs to draw and does not change.
WATCHED = (
    Tunable('', 'simulator', 'surface', ''),
    Tunable('', 'simulator', 'pad_distance', ''),
    Tunable('', 'simulator', 'pushes', ''),
    *(Tunable('', GAIT, name, '') for name in specifications(GaitParameters)),
    *(
        Tunable('', node, name, '')
        for node in controllers()
        for name in specifications(table_of(node))
        if name not in OF_CONTROLLER
    ),
)


@cache
def tunables() -> tuple[Tunable, ...]:
    """Return the parameters that the reader can change, of all controllers and the simulator."""
    found = []
    for node in controllers():
        name = short_name(node)
        title, known = name.replace('_', ' ').capitalize(), specifications(table_of(node))
        of_controller = (
            Tunable('Feedback', node, 'enabled', f'{title} control'),
            Tunable('Feedback', node, 'gain', f'{title} gain{SYMBOLS.get(name, "")}', 0.5),
        )
        found += [each for each in of_controller if each.name in known]
    return (*found, *_OF_SIMULATOR)


def tunables_of(robots: Sequence[str]) -> tuple[Tunable, ...]:
    """Return all parameters of the page, those of the simulator once.

    Args:
        robots: names of the robots of a bout; an empty one of one robot alone.
    """
    every = (*tunables(), *WATCHED)
    return tuple(
        dict.fromkeys(
            each if each.node == 'simulator' or not robot else of_robot(each, robot)
            for robot in robots
            for each in every
        )
    )


def of_robot(tunable: Tunable, robot: str) -> Tunable:
    """Return the parameter of one robot of a bout, in a group of its own."""
    group = tunable.group and f'{tunable.group}, {robot}'
    return replace(tunable, robot=robot, group=group)


@dataclass(frozen=True)
class Control:
    """A checkbox or a slider for a parameter of a live node."""

    tunable: Tunable  # which parameter
    value: Value  # that it has
    hint: str  # meaning and accepted values
    unit: str = ''  # of its value
    # minimum, maximum: of its slider; None for a checkbox
    minimum: float | None = None
    maximum: float | None = None

    @property
    def label(self) -> str:
        """Return the label with its unit."""
        return f'{self.tunable.label}, {self.unit}' if self.unit else self.tunable.label


def control(tunable: Tunable, descriptor: Any, value: Any) -> Control | None:
    """Return the control of a parameter from its ParameterDescriptor, None if it has none."""
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


class PendingChanges:
    """Requested changes: one request per parameter at a time, then its newest value.

    A dragged slider sends requests faster than a node answers. Its earlier values must not come
    back as changes by other clients, or the slider would jump: not even after the answer, for a
    node reports its changes later, and none that it has changed again within a control period.
    """

    def __init__(self) -> None:
        self._next: dict[tuple[str, str], Value] = {}
        self._sent: set[tuple[str, str]] = set()
        self._unreported: dict[tuple[str, str], list[Value]] = {}  # sent values, in their order

    def ask(self, key: tuple[str, str], value: Value) -> None:
        """Store the newest requested value."""
        self._next[key] = value

    def due(self, nodes: Container[str]) -> Mapping[tuple[str, str], Value]:
        """Return the values to send to these nodes now, and mark them as sent."""
        ready = {
            key: value
            for key, value in self._next.items()
            if key[0] in nodes and key not in self._sent
        }
        self._sent |= ready.keys()
        for key, value in ready.items():
            del self._next[key]
            self._unreported.setdefault(key, []).append(value)
        return ready

    def answered(self, key: tuple[str, str], accepted: bool = True) -> None:
        """Note that a node has answered; of a value that it refuses no report comes."""
        self._sent.discard(key)
        if not accepted and (sent := self._unreported.get(key)):
            sent.pop()

    def is_own(self, key: tuple[str, str], value: Value) -> bool:
        """Return whether a reported change was requested here; forget it and all before it."""
        sent = self._unreported.get(key, [])
        found = value in sent
        del sent[: sent.index(value) + 1 if found else None]
        return found

    def __contains__(self, key: object) -> bool:
        return key in self._next or key in self._sent
