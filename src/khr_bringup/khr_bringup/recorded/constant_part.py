"""The part of a correction that no sensor causes: offset of the reference, and constant lean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from khr_bringup.changes import Change
from khr_bringup.node_registry import controllers, table_of
from khr_bringup.scenario.scenario import Scenario
from khr_common.interfaces import STAGE
from khr_common.rotation import Array


def constant_part(node: str, table: Any, time: float, stage: Sequence[float] = ()) -> float:
    """Return the constant part of a correction, rad.

    Args:
        node: the controller.
        table: its parameters; a controller of another package may have no constant part.
        time: s.
        stage: the last sample of the topic ``stage``, if there is one.
    """
    if not hasattr(table, 'constant'):
        return 0.0
    share = 1.0
    if table.staged and len(stage) == len(STAGE.names):
        share = stage[STAGE.names.index(node)]
    return float(share * table.constant(time))


def constant_parts(
    scenario: Scenario, changes: Iterable[Change], times: Array, stages: Array
) -> Array:
    """Return the constant parts of the corrections of a run, rad, (N, number of controllers).

    Args:
        scenario: as it began.
        changes: of parameters while it ran.
        times: s, (N,).
        stages: samples of the topic ``stage`` at these times, (N, any).
    """
    nodes = [node for node in controllers() if node in scenario.nodes]
    found = np.zeros((len(times), len(nodes)))
    pending = sorted(changes, key=lambda change: change.time)
    tables = [scenario.table(table_of(node)) for node in nodes]
    for row, time in enumerate(times.tolist()):
        while pending and pending[0].time < time:
            change = pending.pop(0)
            scenario = scenario.changed({(change.node, change.parameter): change.value})
            tables = [scenario.table(table_of(node)) for node in nodes]
        stage = stages[row].tolist()
        for column, (node, table) in enumerate(zip(nodes, tables, strict=True)):
            found[row, column] = constant_part(node, table, time, stage)
    return found
