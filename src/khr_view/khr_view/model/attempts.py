"""The attempts of a live page: their gains and outcome, and the one that charts show as a ghost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, inf

from khr_analysis.outcome import Outcome
from khr_bringup.node_registry import controllers, short_name
from khr_bringup.scenario.control_text import bare_title
from khr_view.charts.traces import Ghost, Traces
from khr_view.controls import SYMBOLS
from khr_view.model.live_run import LiveRun

MOST = 12  # that are kept
HEADS = ('', 'gains', 'slope', 'verdict', 'slip, mm', 'vibration, deg/s')


@dataclass(frozen=True)
class Attempt:
    """A finished run of the page."""

    number: int  # from 1
    cells: tuple[str, ...]  # text of each column but the first
    ghost: Ghost  # its signals


class Attempts:
    """Keep the last attempts.

    Attributes:
        kept: oldest first.
        chosen: number of the attempt shown as a ghost; 0 for none.
    """

    def __init__(self) -> None:
        self.kept: list[Attempt] = []
        self.chosen = 0

    @property
    def ghost(self) -> Ghost:
        """Return the signals of the chosen attempt."""
        return next((each.ghost for each in self.kept if each.number == self.chosen), {})

    def add(self, run: LiveRun, traces: Traces) -> None:
        """Keep a run that has ended; a run that nobody looked at is not kept.

        It becomes the ghost if the attempt before it was the ghost; a ghost chosen by the reader
        stays.
        """
        outcome = run.status.outcome
        if not isinstance(outcome, Outcome):
            return
        latest = self.kept[-1].number if self.kept else 0
        number = latest + 1
        cut = not outcome.fell and run.now < run.motion.end < inf
        slope = run.of('simulator').get('inclination_deg')
        cells = (
            gains_text(run.known_of_controllers()),
            f'{slope:.4g}°' if slope is not None else '',
            outcome.verdict + ' so far' * cut,
            f'{1e3 * outcome.slip_distance:.1f}',
            f'{degrees(outcome.vibration):.1f}',
        )
        self.kept = [*self.kept, Attempt(number, cells, traces.as_ghost())][-MOST:]
        if self.chosen == latest:
            self.chosen = number

    def choose(self, number: int) -> None:
        """Choose the ghost; the attempt chosen before is no longer shown."""
        self.chosen = 0 if number == self.chosen else number


def gains_text(of_controllers: Mapping[str, Mapping[str, object]]) -> str:
    """Return the gains of the controllers that act, such as ``K_A 12``, or ``no control``."""
    found = []
    for node in controllers():
        known = of_controllers.get(node, {})
        if known.get('enabled') and 'gain' in known:
            name = short_name(node)
            found.append(f'{SYMBOLS.get(name, name).strip()} {known["gain"]:g}')
    return ', '.join(found) or 'no control'


def heading(title: str, of_controllers: Mapping[str, Mapping[str, object]], time: float) -> str:
    """Return the heading of a picture of the charts: scenario, gains, and time in s."""
    return f'{bare_title(title)}, {gains_text(of_controllers)}, at {time:.2f} s'
