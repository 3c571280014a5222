"""A block: a core that answers each instant, the same object in a node and in the offline twin."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from khr_common.interfaces import Topic

GROUP = 'khr.nodes'  # of the entry points that name the nodes
Numbers = Sequence[float]
Signals = Mapping[Topic, Numbers]  # what each topic carries at one instant, see khr_common.cdr
Table = TypeVar('Table')
Contravariant = TypeVar('Contravariant', contravariant=True)


class Block(ABC, Generic[Table]):
    """Turn the signals of an instant into those that answer it.

    Subclasses state their topics and define :meth:`update`; one with states that depend on
    parameters extends :meth:`configure`. Every run has a block of its own.

    Attributes:
        subscribes: all topics that it may need.
        publishes: what it answers on.
        parameters: its table.
    """

    subscribes: ClassVar[tuple[Topic, ...]]
    publishes: ClassVar[tuple[Topic, ...]]

    def __init__(self, parameters: Table) -> None:
        self.parameters = parameters

    def configure(self, parameters: Table) -> None:
        """Take changed parameters from the next instant on, keeping the state."""
        self.parameters = parameters

    @property
    def needs(self) -> tuple[Topic, ...]:
        """Return the topics whose signals :meth:`update` reads with the present parameters."""
        return self.subscribes

    @abstractmethod
    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Answer the instant ``time``, in s.

        Args:
            time: of the instant, s.
            signals: of :attr:`needs`, and perhaps more.

        Returns:
            The numbers of each topic of :attr:`publishes`.

        Raises:
            KhrError: if a signal is not one that the block can answer.
        """


class Core(Protocol[Contravariant]):
    """What a block may hold: something with parameters and a state."""

    def configure(self, parameters: Contravariant) -> None:
        """Take changed parameters, keeping the state."""


CoreType = TypeVar('CoreType', bound=Core[Any])


class CoreBlock(Block[Table], Generic[Table, CoreType]):
    """A block around a core of its own.

    Attributes:
        core: that :meth:`update` steps.
    """

    def __init__(self, parameters: Table, core: CoreType) -> None:
        super().__init__(parameters)
        self.core = core

    def configure(self, parameters: Table) -> None:
        """Pass changed parameters to the core."""
        super().configure(parameters)
        self.core.configure(parameters)


@dataclass(frozen=True)
class NodeSpec:
    """What the graph has to know of a node; entry points of the group ``khr.nodes`` name these.

    Attributes:
        name: of node and executable.
        package: that holds it.
        table: its parameters, a frozen dataclass of its own.
        block: what answers each instant; None for a node that answers nothing.
        subscribes, publishes: its topics; by default those of the block.
        node: its class as ``module:Class``; by default the node that runs a block.
        joins: says from its table whether it takes part in a run; by default it always does.
        listens: whether a run waits until it has received every instant, see ``Listener``.
        drives: whether it takes the simulator's place, and takes part only where it is named as
            the driver.
        brings: of a driver, which of its topics it publishes with a table; by default all.
    """

    name: str
    package: str
    table: type[Any]
    block: type[Block[Any]] | None = None
    subscribes: tuple[Topic, ...] = ()
    publishes: tuple[Topic, ...] = ()
    node: str = 'khr_common.nodes.block_node:BlockNode'
    joins: Callable[[Any], bool] = lambda _: True
    listens: bool = False
    drives: bool = False
    brings: Callable[[Any], tuple[Topic, ...]] | None = None

    def __post_init__(self) -> None:
        if self.block is not None:
            for name in ('subscribes', 'publishes'):
                object.__setattr__(self, name, getattr(self, name) or getattr(self.block, name))

    def brought(self, table: Any) -> tuple[Topic, ...]:
        """Return what the node publishes with a table."""
        return self.publishes if self.brings is None else self.brings(table)
