"""Parameter changes of a running graph, as its nodes report them on ``diagnostics``."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from khr_bringup.node_registry import registry, table_of
from khr_common import specifications
from khr_common.errors import MalformedError
from khr_common.statuses import AFTER, CHANGED, integer


@dataclass(frozen=True)
class Change:
    """A parameter change of a running node."""

    # node, parameter: that was set
    node: str
    parameter: str
    value: Any  # the new one
    after_ns: int  # stamp of the last sample without the change, ns; -1 if all samples have it

    @property
    def time(self) -> float:
        """Return the simulated time of the change, s."""
        return max(self.after_ns, 0) / 1e9


def changes_in(arrays: Iterable[Any]) -> list[Change]:
    """Return the parameter changes in messages on ``diagnostics``, in their order.

    Malformed entries and those of unknown nodes are skipped.
    """
    found = []
    for status in (status for array in arrays for status in array.status):
        node, values = status.name.removesuffix(CHANGED), {p.key: p.value for p in status.values}
        if node == status.name or node not in registry():
            continue
        known = specifications(table_of(node))
        with suppress(MalformedError, ValueError):
            after_ns = integer(values, AFTER)
            found += [
                Change(node, name, json.loads(text), after_ns)
                for name, text in values.items()
                if name in known
            ]
    return found
