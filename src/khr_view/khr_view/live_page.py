"""The page of live runs: its display and controls outlive each run."""

from __future__ import annotations

from collections.abc import Sequence

from khr_bringup.scenario.scenario import shipped
from khr_view.charts.charts import charts
from khr_view.guard import AccessGuard
from khr_view.model.live_run import Attempts
from khr_view.page.display import BOUT_AWAY, Display
from khr_view.page.panels import LivePanel
from khr_view.session import EndAction, Session


class LivePage:
    """Serve a page on which one run after the other is shown.

    Args:
        guard: of the page's socket.
        session: of the runs; without it the page only shows a run, and restarts none.
        at_the_end: the action that follows the end of a run.
        robots: names of the robots of a bout; an empty one of one robot alone.

    Attributes:
        display, panel: of the page.
        session: of the runs.
        robots: names of the robots on the page.
        at_the_end: as the reader has chosen.
        attempts: the runs that have ended.
    """

    def __init__(
        self,
        guard: AccessGuard,
        session: Session | None = None,
        at_the_end: EndAction = 'never',
        robots: Sequence[str] = ('',),
    ) -> None:
        self.session, self.at_the_end, self.robots = session, at_the_end, tuple(robots)
        several = len(self.robots) > 1
        away = BOUT_AWAY if several else 1.0
        self.display = Display(
            guard, charts(), self.robots, attempts=not several, away=away, tabs=several
        )
        server, later = self.display.server, self.display.later
        scenarios = [path.stem for path in shipped()] if session else []
        own = self.robots if several else ()
        self.panel = LivePanel(server, later, scenarios, at_the_end, own)
        self.display.add_look()
        self.attempts = Attempts()
