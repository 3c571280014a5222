"""Play recorded runs back: the time that is shown, and the loop that shows it."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from pathlib import Path

import numpy as np

from khr_bringup.recorded.bags import robots_in
from khr_common.signals import interpolated
from khr_view.charts.charts import BLUE, DASHES, ORANGE, RED, Array, Chart, Curve, charts
from khr_view.charts.traces import shade
from khr_view.guard import listen
from khr_view.model.recorded import Timeline
from khr_view.model.status import side_by_side
from khr_view.session import PAUSE
from khr_view.viewing import Report, Viewing, announce

RATE = 30.0  # pictures per s
CHARTS_EVERY = 5  # pictures
SIDE = 0.36  # m between two robots
ENDED = 'its recording has ended'


@dataclass
class Player:
    """The playback time of a recording."""

    end: float  # of the longest run, s
    period: float  # of a single step, s
    now: float = 0.0  # shown time, s
    speed: float = 1.0  # simulated over wall time
    playing: bool = True  # whether it is not paused
    loop: bool = True  # whether it restarts after the end
    rested: float = 0.0  # wall time since the end was reached, s

    def play(self, on: bool) -> None:
        """Play (from the start if at the end) or pause."""
        self.playing = on
        if on and self.now >= self.end:
            self.now = 0.0

    def seek(self, time: float) -> None:
        """Show a time, s."""
        self.now = min(max(time, 0.0), self.end)

    def step(self, periods: int) -> None:
        """Pause, and move by some control periods."""
        self.playing = False
        self.seek(self.now + periods * self.period)

    def advance(self, wall: float) -> None:
        """Advance by ``wall`` s of wall time; the end is shown for a while before a restart."""
        if not self.playing:
            return
        if self.now < self.end:
            self.now, self.rested = min(self.now + wall * self.speed, self.end), 0.0
        elif not self.loop:
            self.playing = False
        else:
            self.rested += wall
            if self.rested >= PAUSE:
                self.now = 0.0


class PlayedRuns:
    """The traces of one run, or of two at one time: a colour for each run, dashes for each line.

    Args:
        runs: one or two.
        colors: of two.

    Attributes:
        charts: of the lines that are recorded.
    """

    def __init__(self, runs: Sequence[Timeline], colors: tuple[str, str] = (BLUE, ORANGE)) -> None:
        self._runs, self._colors = runs, colors
        self._parts: dict[str, list[Chart]] = {}  # of each run, by title
        found = []
        for chart in charts():
            parts = [
                replace(chart, lines=tuple(filter(run.recorded, chart.lines))) for run in runs
            ]
            lines = tuple(line for each in self._named(parts) for line in each)
            if lines:
                self._parts[chart.title] = parts
                found.append(replace(chart, lines=lines))
        self.charts = tuple(found)
        self.now = 0.0

    def _named(self, parts: Sequence[Chart]) -> Iterator[Iterable[Curve]]:
        for run, part, color in zip(self._runs, parts, self._colors, strict=False):
            yield (
                part.lines
                if len(self._runs) == 1
                else (
                    replace(line, label=f'{line.label}, {run.name}', color=color, dash=dash)
                    for line, dash in zip(part.lines, cycle(DASHES), strict=False)
                )
            )

    def shades(self, times: Array) -> tuple[Array, ...]:
        """Return the phases of the first run's gait, and the events of all runs."""
        events = [event for run in self._runs for event in run.marks]
        return shade(times, self._runs[0].motion.swings, events)

    def ghost(self, chart: Chart, times: Array) -> Array:
        """Return no earlier attempt."""
        return np.full(len(times), np.nan)

    def columns(self, chart: Chart) -> tuple[Array, ...]:
        """Return times and the values of each curve; NaN where a run has no sample."""
        parts = zip(self._runs, self._parts[chart.title], strict=True)
        found = [run.columns(part, self.now) for run, part in parts if part.lines]
        times = max((own for own, *_ in found), key=len)
        return times, *(
            interpolated(times, own, values) for own, *lines in found for values in lines
        )


def play(paths: Sequence[Path], viewing: Viewing, report: Report, namespace: str = '') -> int:
    """Play runs back, side by side, until interrupted; return the exit code.

    The robots of a bout are in one world.

    Args:
        paths: folders of runs, or bags.
        viewing: how the page is shown, and whether they restart after their end.
        report: prints a line.
        namespace: of the robot, in a bag of several; without one all robots of a bout are shown.
    """
    from khr_view.page.charts import NO_SPECTRUM
    from khr_view.page.display import BOUT_AWAY, Display
    from khr_view.page.panels import PlaybackPanel

    runs, together = timelines(paths, namespace)
    interrupted: list[int] = []
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, lambda caught, _: interrupted.append(caught))
    end, period = max(run.end for run in runs), min(run.period for run in runs)
    player = Player(end, period, loop=viewing.again != 'never')
    played = PlayedRuns(runs, (RED, BLUE)) if together else PlayedRuns(runs)
    names = [run.name for run in runs] if len(runs) > 1 else ['']
    away = BOUT_AWAY if together else 1.0
    guard = listen(viewing.host, viewing.port)
    announce(guard, viewing.browser, report)
    display = Display(guard, played.charts, names, away=away)
    for number, (run, name) in enumerate(zip(runs, names, strict=True)):
        aside = 0.0 if together else -number * SIDE
        display.add_robot(run.robot, (0.0, aside, 0.0), name)
    panel = PlaybackPanel(display.server, display.later, player, runs)
    display.add_look()
    title = runs[0].title if len(runs) == 1 else ' | '.join(run.name for run in runs)
    title = f'{runs[0].title}: {title}' if together else title
    damage = '; '.join(run.damage for run in runs if run.damage)
    count, shown, before = 0, -1.0, time.monotonic()
    while not interrupted:
        time.sleep(1.0 / RATE)
        now = time.monotonic()
        if display.readers:  # so that the first one sees it from its start
            player.advance(now - before)
        count, before = count + 1, now
        display.act()
        panel.show(player)
        if not display.readers or (player.now == shown and count % CHARTS_EVERY):
            continue
        shown = played.now = player.now
        display.show_scenes([run.snapshot(player.now) for run in runs], together)
        if count % CHARTS_EVERY == 0:
            display.show_traces(played)
            for number, run in enumerate(runs):
                absent = ENDED if player.now > run.end else NO_SPECTRUM
                display.show_spectrum(run.spectrum(player.now), number, absent)
            picture = '\n'.join(
                f'{name}: ' * bool(name) + run.heading(player.now)
                for run, name in zip(runs, names, strict=True)
            )
            rows = side_by_side([run.rows(player.now) for run in runs])
            display.show_status(title, rows, damage, picture)
    display.close()
    return 0


def timelines(paths: Sequence[Path], namespace: str = '') -> tuple[list[Timeline], bool]:
    """Return the runs to play, and whether they are the robots of one bout.

    Args:
        paths: folders of runs, or bags; the only one may be that of a round.
        namespace: of the robot, in a bag of several.
    """
    robots = robots_in(paths[0]) if len(paths) == 1 and not namespace else []
    if len(robots) == 2:
        return [Timeline(paths[0], robot, robot) for robot in robots], True
    return [Timeline(path, namespace) for path in paths], False
