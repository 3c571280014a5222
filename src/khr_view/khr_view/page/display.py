"""The page: scene, charts, status and controls; actions of readers are queued."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from math import inf
from queue import SimpleQueue
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from khr_description.robot import Robot
from khr_view.charts.charts import Chart
from khr_view.charts.spectrum_lines import SpectrumLines
from khr_view.charts.traces import Columns, signals_csv
from khr_view.guard import AccessGuard
from khr_view.model.scene import Snapshot
from khr_view.page.charts import NO_SPECTRUM, SpectrumChart, TimeCharts
from khr_view.page.scene_view import Push, RobotView, SlopeView
from khr_view.page.server import PageServer

ROOT = '/world'
TITLE = 'khr'
# From pale to dark, about Okabe and Ito's blue; viser takes those at 6 and 8.
BRAND = (
    '#e6f2fa',
    '#cce5f4',
    '#99cbe9',
    '#66b1de',
    '#3397d3',
    '#1a85c2',
    '#0072b2',
    '#00649c',
    '#005a8c',
    '#004a73',
)
PUSH_SHOWN = 0.5  # s of wall time
TARGET = (0.0, 0.0, 0.17)  # m, what the camera looks at: the middle of the robot
# Places of the camera from there, m.
VIEWS = {
    'Side view': (0.0, -0.9, 0.0),
    'From above': (-0.02, 0.0, 0.8),
    'Default view': (0.45, -0.75, 0.18),
}
# More from the front: the robot that is ahead hides the other one less.
OF_TWO = (0.75, -0.5, 0.2)
BACKWARD = 1.0  # share by which the camera is further away for each m between two robots
SAVE = (
    '<div class="khr-save">'
    '<a href="khr/{signals}" download="{signals}">Signals as CSV</a>'
    '{spectra}'
    '<button data-khr="picture">Charts as PNG</button>'
    '</div>'
)
SAVE_SPECTRUM = '<a href="khr/{file}" download="{file}">Spectrum{number} as CSV</a>'
NONE_YET = '<tr><td colspan="6">none yet: a run is listed once it has ended</td></tr>'
BOUT_AWAY = 1.4  # of the camera from two robots of a bout, over that from one
LOADING = '<div class="khr">Loading ...</div>'  # not khr-state, which the browser waits for


class Display:
    """Show frames in all connected browsers.

    Args:
        guard: where it is served.
        charts: to show.
        names: of several runs, for their spectra.
        attempts: whether charts show an earlier attempt as a ghost.
        away: distance of the camera, over that from one robot.
        tabs: whether each of the names has charts of its own, in a tab.

    Attributes:
        server: of the page.
    """

    def __init__(
        self,
        guard: AccessGuard,
        charts: tuple[Chart, ...],
        names: Sequence[str] = ('',),
        attempts: bool = False,
        away: float = 1.0,
        tabs: bool = False,
    ) -> None:
        self._away = away
        self._acts: SimpleQueue[Callable[[], object]] = SimpleQueue()
        self.server = PageServer(guard, TITLE)
        server = self.server
        server.scene.configure_environment_map(hdri=None)
        # Shadows need a scene of metres: on a robot of 0.4 m they are all noise.
        server.scene.configure_default_lights(enabled=False)
        server.scene.add_light_ambient('/light/around', intensity=1.3)
        for number, place in enumerate(((0.6, -1.0, 1.4), (-0.8, 0.9, 0.9))):
            server.scene.add_light_directional(
                f'/light/sun_{number}', intensity=1.8 - number, position=place
            )
        self._root = server.scene.add_frame(ROOT, show_axes=False)
        self._slope = SlopeView(server.scene, ROOT)
        self._robots: list[RobotView] = []
        self._follow, self._between = True, 0.0
        self._marked, self._through = True, False  # the choices of the reader, for each new robot
        self._place(server.initial_camera)
        self._push_until = inf
        self._theme(dark=False)
        self._status = server.gui.add_html(LOADING)
        self._attempts = server.gui.add_html('')
        panel = server.gui.add_panel()
        self._spectra: list[SpectrumChart] = []
        self._charts: list[TimeCharts] = []
        groups = {name: (name,) for name in names} if tabs else {'Signals': tuple(names)}
        for title, own in groups.items():
            with panel.add_tab(title):
                self._add_charts(charts, own, attempts)
        panel.dock_left()
        panel.set_width(360)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(340)

    def _add_charts(self, charts: tuple[Chart, ...], names: Sequence[str], attempts: bool) -> None:
        """Add the spectra of some runs, and charts over time with the links to their data."""
        gui, tables, links = self.server.gui, self.server.tables, ''
        spectra = [SpectrumChart(gui, name) for name in names]
        timed = TimeCharts(gui, charts, attempts)
        for chart in spectra:
            self._spectra.append(chart)
            number = len(self._spectra)
            file = f'spectrum{number}.csv' if number > 1 else 'spectrum.csv'
            links += SAVE_SPECTRUM.format(file=file, number=f' {number}' if number > 1 else '')
            tables[file] = chart.csv
        self._charts.append(timed)
        signals = f'signals{len(self._charts)}.csv' if len(self._charts) > 1 else 'signals.csv'
        tables[signals] = lambda: signals_csv(timed.drawn)
        gui.add_html(SAVE.format(signals=signals, spectra=links))
        with gui.add_folder('Choose', expand_by_default=False):
            for chart in spectra:
                chart.add_choice(gui)
            timed.add_choice(gui)

    @property
    def readers(self) -> int:
        """Count the connected browsers."""
        return len(self.server.get_clients())

    def add_robot(
        self,
        robot: Robot,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
        name: str = '',
        push: Push | None = None,
    ) -> None:
        """Put a robot on the slope, its name above its head; dragging its torso pushes it."""
        at = f'{ROOT}/robot_{len(self._robots)}'
        self._between = shift[1]
        self._place(self.server.initial_camera)
        self._robots.append(RobotView(self.server.scene, at, robot, shift, name))
        self._robots[-1].see_through(self._through)
        self._robots[-1].marks.show_all(self._marked)
        if push is not None:
            self._robots[-1].on_drag(partial(self.later, push))

    def restart(self) -> None:
        """Prepare for another run: its robot and spectra replace those shown."""
        self._robots.clear()
        for spectrum in self._spectra:
            spectrum.forget()

    def later(self, act: Callable[..., object], *values: Any) -> None:
        """Queue an action of a reader for the thread of the display; called by viser's threads."""
        self._acts.put(partial(act, *values))

    def act(self) -> None:
        """Run the queued actions, in their order."""
        while not self._acts.empty():
            self._acts.get()()

    def show_scenes(self, scenes: Sequence[Snapshot | None], together: bool = False) -> None:
        """Update the poses of the robots.

        Args:
            scenes: of each robot.
            together: whether they share one world: the camera then follows their middle, and
                else the first.
        """
        with self.server.atomic():
            for robot, scene in zip(self._robots, scenes, strict=True):
                if scene is not None:
                    robot.show(scene)
            first = scenes[0] if scenes else None
            if first is not None:
                if time.monotonic() > self._push_until:
                    for number, scene in enumerate(scenes):
                        if scene is not None:
                            self.show_push(scene, np.zeros(3), number=number)
                self._slope.show(first)
                for robot, scene in list(zip(self._robots, scenes, strict=True))[1:]:
                    if scene is not None:
                        robot.tilt(first.inclination - scene.inclination)
                if self._follow:
                    followed = [each for each in scenes if each] if together else [first]
                    self._root.position = -np.mean([each.way for each in followed], axis=0)

    def show_push(
        self, scene: Snapshot, force: NDArray[np.float64], acts: bool = False, number: int = 0
    ) -> None:
        """Show a push on a robot; one that acts disappears after a while."""
        self._robots[number].marks.show_push(scene, force)
        self._push_until = time.monotonic() + PUSH_SHOWN if acts else inf

    def add_look(self) -> None:
        """Add the controls of the view."""
        gui = self.server.gui
        with gui.add_folder('View'):
            forces = gui.add_checkbox('Forces and balance', True)
            through = gui.add_checkbox('See through the robot', False)
            follow = gui.add_checkbox('Follow the robot', True)
            dark = gui.add_checkbox('Dark', False)
            for name in VIEWS:
                button = gui.add_button(name, color='gray')
                button.on_click(partial(self._look_from, name))
        through.on_update(lambda _: self._see_through(through.value))
        forces.on_update(lambda _: self._show_marks(forces.value))
        follow.on_update(lambda _: setattr(self, '_follow', follow.value))
        dark.on_update(lambda _: self._theme(dark.value))

    def _look_from(self, name: str, event: Any) -> None:
        self._place(event.client.camera, name)

    def _place(self, camera: Any, name: str = 'Default view') -> None:
        """Have a camera show all robots."""
        middle = np.add(TARGET, (0.0, self._between / 2.0, 0.0))
        away = self._away + BACKWARD * abs(self._between)
        view = OF_TWO if self._between and name == 'Default view' else VIEWS[name]
        camera.position = tuple((middle + np.multiply(view, away)).tolist())
        camera.look_at = tuple(middle.tolist())

    def _see_through(self, through: bool) -> None:
        self._through = through
        for robot in self._robots:
            robot.see_through(through)

    def _show_marks(self, visible: bool) -> None:
        self._marked = visible
        for robot in self._robots:
            robot.marks.show_all(visible)

    def _theme(self, dark: bool) -> None:
        self.server.gui.configure_theme(
            show_logo=False,
            show_share_button=False,
            brand_color=cast(Any, BRAND),  # it takes ten colours as well
            dark_mode=dark,
        )

    def show_traces(self, traces: Columns, number: int = 0) -> None:
        """Draw the charts over time, of the tab with a number."""
        self._charts[number].show(traces)

    def show_spectrum(
        self, lines: SpectrumLines | None, number: int = 0, absent: str = NO_SPECTRUM
    ) -> None:
        """Draw the spectrum of a run; without one clear it, and show why it is absent."""
        if lines is None:
            self._spectra[number].forget(absent)
        else:
            self._spectra[number].show(lines)

    def show_status(
        self, state: str, rows: Sequence[tuple[str, ...]], trouble: str = '', picture: str = ''
    ) -> None:
        """Write how the run goes.

        Args:
            state: of the run.
            rows: of the table below it.
            trouble: an error for the reader.
            picture: heading of saved pictures of the charts.
        """
        cells = ''.join(
            '<tr>' + ''.join(f'<td>{escape(cell)}</td>' for cell in row) + '</tr>' for row in rows
        )
        note = f'<div class="khr-note">{escape(trouble)}</div>' if trouble else ''
        self._status.content = (
            f'<div class="khr" data-khr-title="{escape(picture, quote=True)}">'
            f'<div class="khr-state">{escape(state)}</div>{note}'
            f'<table>{cells}</table></div>'
        )

    def show_attempts(
        self,
        heads: Sequence[str],
        rows: Sequence[tuple[int, Sequence[str]]],
        chosen: int,
        choose: Callable[[int], object],
    ) -> None:
        """List the attempts; a click on one calls ``choose`` with its number.

        The list keeps its height, and scrolls.
        """
        head = ''.join(f'<th>{escape(each)}</th>' for each in heads)
        body = ''
        for number, cells in rows:
            self.server.tables[f'attempt/{number}'] = partial(self._on_attempt, choose, number)
            mark = ' class="khr-chosen"' if number == chosen else ''
            texts = ''.join(f'<td>{escape(cell)}</td>' for cell in (str(number), *cells))
            body += f'<tr data-khr-attempt="{number}"{mark}>{texts}</tr>'
        self._attempts.content = (
            '<div class="khr"><b>Attempts</b>: click to show one in grey</div>'
            f'<div class="khr khr-attempts"><table><tr>{head}</tr>{body or NONE_YET}</table></div>'
        )

    def _on_attempt(self, choose: Callable[[int], object], number: int) -> str:
        self.later(choose, number)
        return ''

    def close(self) -> None:
        """Stop serving the page."""
        self.server.stop()
