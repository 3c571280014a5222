"""What all panels over time of a run share: the swings of the feet, and its events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.events import Event
from khr_bringup.scenario.derived import swings
from khr_bringup.scenario.scenario import Scenario
from khr_report.plots.plot_style import COLORS

EVENTS_NAMED = 9
CHANGED = ', changed while it ran'


@dataclass(frozen=True)
class Timing:
    """What all panels over time share."""

    gait: GaitParameters | None = None  # whose swings of the feet are shaded
    events: Sequence[Event] = ()  # changes of parameters, pushes, falls

    def draw(self, axes: Sequence[Axes]) -> None:
        """Shade the swings and mark the events; the top panel names them."""
        shades = swings(self.gait) if self.gait else {}
        for axis in axes:
            for color, side in zip(COLORS, ('left', 'right'), strict=False):
                for start, end in shades.get(side, ()):
                    axis.axvspan(start, end, color=color, alpha=0.1, linewidth=0.0, zorder=0)
            for event in self.events:
                axis.axvline(event.time, color='0.2', linestyle=':', linewidth=0.8)
        for number, event in enumerate(self.events[:EVENTS_NAMED]):
            axes[0].annotate(
                event.text,
                (event.time, 1.0),
                xytext=(2, -8 - 8 * (number % 3)),
                textcoords='offset points',
                xycoords=('data', 'axes fraction'),
                fontsize=6,
                annotation_clip=True,
                bbox={'facecolor': 'white', 'alpha': 0.8, 'edgecolor': 'none', 'pad': 0.5},
            )


def title_of_run(scenario: Scenario, events: Sequence[Event]) -> str:
    """Return the title of a run; it says so if parameters were changed while it ran."""
    changed = any('=' in event.text for event in events)
    return (scenario.title or scenario.name) + CHANGED * changed
