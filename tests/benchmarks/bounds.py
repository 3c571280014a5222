"""What the ratios of the benchmarks cannot exceed, by what was measured beside them."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from tests.benchmarks import bench_environment as environment
from tests.benchmarks import bench_graph as graph
from tests.benchmarks.clock import WALL, Numbers


class Bound(NamedTuple):
    """The largest that a ratio can be, and what alone is left of the run then."""

    most: float
    left: str


Bounds = dict[tuple[str, str], Bound]  # by the names of both cases


def bounds_of(
    graphs: Mapping[str, Sequence[Numbers]],
    messages: Sequence[Mapping[str, Numbers]],
    environments: Sequence[Mapping[str, Numbers]],
) -> Bounds:
    """Return the bounds, of medians; none of what was not measured."""
    return {
        **(_steps(graphs) if graph.STEPS in graphs else {}),
        **(_exchanges(graphs, messages) if graphs and messages else {}),
        **{
            pair: bound
            for engine in environment.ENGINES
            for pair, bound in _apart(environments, engine).items()
        },
    }


def _took(runs: Sequence[Numbers]) -> float:
    """Return wall time per simulated time."""
    return 1.0 / statistics.median(run[WALL] for run in runs)


def _steps(graphs: Mapping[str, Sequence[Numbers]]) -> Bounds:
    most = _took(graphs[graph.RAW]) / _took(graphs[graph.STEPS])
    left = 'its steps: calls of PyBullet, contacts, servos, joint states; nothing once a period'
    return {(graph.TWIN, graph.RAW): Bound(most, left)}


def _exchanges(
    graphs: Mapping[str, Sequence[Numbers]], messages: Sequence[Mapping[str, Numbers]]
) -> Bounds:
    bare = {name: _took([each[name] for each in messages]) for name in messages[0]}
    read = 'the twin, spectra and frames, and the messages, whose numbers are filled in and read, '
    return {
        **{
            (name, graph.TWIN): Bound(bare[graph.TWIN] / bare[name], read + where)
            for name, where in (
                (graph.ONE, 'in one process'),
                (graph.EACH, 'from process to process'),
            )
        },
        **{
            (recorded, name): Bound(
                took / (took + bare[recorded] - bare[name]),
                'the run, and a recorder that writes its messages as they come',
            )
            for recorded, name in (
                (graph.ONE_RECORDED, graph.ONE),
                (graph.EACH_RECORDED, graph.EACH),
            )
            for took in [_took(graphs[name])]
        },
    }


def _apart(rounds: Sequence[Mapping[str, Numbers]], engine: str) -> Bounds:
    each, alone, apart = (
        environment.named(case, engine)
        for case in (environment.EACH, environment.ALONE, environment.APART)
    )
    if not rounds or apart not in rounds[0]:
        return {}
    most = statistics.median(run[apart][WALL] / run[alone][WALL] for run in rounds)
    return {(each, alone): Bound(most, 'as many processes apart, the longest of each step')}
