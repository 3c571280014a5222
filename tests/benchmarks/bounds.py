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
        **(_calls(graphs) if graph.CONTACTS in graphs else {}),
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


def _calls(graphs: Mapping[str, Sequence[Numbers]]) -> Bounds:
    most = _took(graphs[graph.RAW]) / _took(graphs[graph.CONTACTS])
    left = 'its calls of PyBullet, contacts read for the foot forces'
    return {(graph.TWIN, graph.RAW): Bound(most, left)}


def _exchanges(
    graphs: Mapping[str, Sequence[Numbers]], messages: Sequence[Mapping[str, Numbers]]
) -> Bounds:
    twin, one = _took(graphs[graph.TWIN]), _took(graphs[graph.ONE])
    bare = {name: _took([each[name] for each in messages]) for name in messages[0]}
    taken = bare[graph.ONE_RECORDED] - bare[graph.ONE]
    return {
        (graph.ONE, graph.TWIN): Bound(
            twin / (twin + bare[graph.ONE]), 'the twin and the messages'
        ),
        (graph.ONE_RECORDED, graph.ONE): Bound(
            one / (one + taken), 'the run, and what the recorder takes and does not write'
        ),
        (graph.EACH, graph.TWIN): Bound(
            twin / (twin + bare[graph.EACH]), 'the twin and the messages from process to process'
        ),
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
