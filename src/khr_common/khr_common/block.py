"""A block: a core that answers each sample, the same object in a node and in the offline twin."""

from __future__ import annotations

import inspect
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from khr_common.interfaces import Topic

GROUP = 'khr.nodes'  # of the entry points that name the nodes
Numbers = Sequence[float]
Signals = Mapping[Topic, Numbers]  # numbers of each topic at one sample, see khr_common.cdr
Table = TypeVar('Table')


class Block(ABC, Generic[Table]):
    """Compute the output signals for the input signals of a sample.

    Subclasses declare their topics and define :meth:`update`; a subclass whose state depends on
    parameters extends :meth:`configure`. Each run creates its own blocks.

    Attributes:
        subscribes: all topics that the block may need.
        publishes: its output topics.
        parameters: its parameter table.
    """

    subscribes: ClassVar[tuple[Topic, ...]]
    publishes: ClassVar[tuple[Topic, ...]]

    def __init__(self, parameters: Table) -> None:
        self.parameters = parameters

    def check(self, parameters: Table) -> None:
        """Refuse changed parameters that :meth:`configure` could not use; by default none.

        Raises:
            KhrError: in one line, which answers the one who sets them.
        """

    def configure(self, parameters: Table) -> None:
        """Use changed parameters from the next sample on; keep the state."""
        self.parameters = parameters

    @property
    def needs(self) -> tuple[Topic, ...]:
        """Return the topics that :meth:`update` reads with the present parameters."""
        return self.subscribes

    @abstractmethod
    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Compute the outputs for the sample at ``time``.

        Args:
            time: of the sample, s.
            signals: of :attr:`needs`, and perhaps more.

        Returns:
            The numbers of each topic of :attr:`publishes`.

        Raises:
            KhrError: if a signal is not one that the block can answer.
        """


class Core(Protocol):
    """A stateful core inside a block."""

    def configure(self, parameters: Any) -> None:
        """Take changed parameters, keeping the state."""


CoreType = TypeVar('CoreType', bound=Core)


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
    """The description of a node; packages register it as an entry point of ``khr.nodes``."""

    name: str  # of node and executable
    package: str  # of the node
    table: type[Any]  # its parameter table, a frozen dataclass
    # computes its outputs for each sample; None for a node without outputs in lockstep
    block: type[Block[Any]] | None = None
    # subscribes, publishes: its topics; by default those of the block
    subscribes: tuple[Topic, ...] = ()
    publishes: tuple[Topic, ...] = ()
    # its class as module:Class; by default the node that runs a block
    node: str = 'khr_common.nodes.block_node:BlockNode'
    # decides from the table whether the node takes part in a run; by default it does
    joins: Callable[[Any], bool] = lambda _: True
    # whether a run waits until the node has received every sample, see Listener
    listens: bool = False
    # whether the node replaces the simulator; it takes part only as the named driver
    drives: bool = False
    # of a driver, the topics that it publishes with a table; by default all
    brings: Callable[[Any], tuple[Topic, ...]] | None = None

    def __post_init__(self) -> None:
        if self.block is not None:
            for name in ('subscribes', 'publishes'):
                object.__setattr__(self, name, getattr(self, name) or getattr(self.block, name))

    def brought(self, table: Any) -> tuple[Topic, ...]:
        """Return the topics that the node publishes with a table."""
        return self.publishes if self.brings is None else self.brings(table)


def error_text(kind: type[Any], error: Exception) -> str:
    """Return an exception of a block as one line with the type, the text, file and line."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename == inspect.getfile(kind)]
    place = (own or frames)[-1]
    text = ' '.join(str(error).split())
    return f'{type(error).__name__}: {text} ({place.filename}, line {place.lineno})'


def print_traceback(kind: type[Any], error: Exception) -> None:
    """Print the traceback of an exception on stderr, from the file of the block on."""
    frames = error.__traceback__
    while frames and frames.tb_frame.f_code.co_filename != inspect.getfile(kind):
        frames = frames.tb_next
    traceback.print_exception(type(error), error, frames or error.__traceback__)
