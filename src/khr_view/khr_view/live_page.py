"""The page of live runs: its display and controls outlive each run."""

from __future__ import annotations

from khr_bringup.scenario.scenario import shipped
from khr_view.charts.charts import charts
from khr_view.guard import AccessGuard
from khr_view.model.attempts import Attempts
from khr_view.model.restart import EndAction
from khr_view.page.display import Display
from khr_view.page.live_panel import LivePanel
from khr_view.session import Session


class LivePage:
    """Serve a page on which one run after the other is shown.

    Args:
        guard: of the page's socket.
        session: of the runs; without it the page only shows a run, and restarts none.
        at_the_end: the action that follows the end of a run.

    Attributes:
        display, panel: of the page.
        session: of the runs.
        at_the_end: as the reader has chosen.
        attempts: the runs that have ended.
    """

    def __init__(
        self, guard: AccessGuard, session: Session | None = None, at_the_end: EndAction = 'never'
    ) -> None:
        self.session, self.at_the_end = session, at_the_end
        self.display = Display(guard, charts(), attempts=True)
        server, later = self.display.server, self.display.later
        scenarios = [path.stem for path in shipped()] if session else []
        self.panel = LivePanel(server, later, scenarios, at_the_end)
        self.display.add_look()
        self.attempts = Attempts()

    def close(self) -> None:
        """Stop serving the page."""
        self.display.close()
