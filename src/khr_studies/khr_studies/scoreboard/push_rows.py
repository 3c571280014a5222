"""Compare pushes on the standing robot with the thesis: control lets it survive larger ones."""

from __future__ import annotations

from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench
from khr_studies.push.study import PushCondition, largest_push
from khr_studies.scoreboard.rows import grows, kind_of, row
from khr_sweeps.trial import Row


def push_force(condition: PushCondition) -> Row:
    """Return the largest push that the robot survives, N."""
    return {'force_n': largest_push(condition).middle}


def conditions(published: thesis.ThesisPush) -> tuple[PushCondition, PushCondition]:
    """Return the pushes without and with control."""
    without = PushCondition(0.0, published.duration, published.direction)
    return without, PushCondition(published.gain, published.duration, published.direction)


def push_row(published: thesis.ThesisPush, bench: Bench) -> Row:
    """Compare the largest pushes without and with control; a record as of standing."""
    forces = bench.pushes(push_force, conditions(published))
    return row(
        4,
        kind_of(published.fitted),
        grows(forces, thesis.GROWS * forces[0]),
        name=f'largest push from {published.direction}, no control and K_A {published.gain:g}',
        unit='N',
        inclinations_deg=(0.0,),
        thesis='recovers with control',
        source=published.source,
        criterion=f'{thesis.GROWS:.0%} larger with control',
        values=forces,
        difference=None,
    )
