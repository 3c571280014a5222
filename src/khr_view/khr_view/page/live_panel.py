"""The controls of a live run."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from khr_view.controls import Control, Tunable, Value, tunables
from khr_view.model.again import HOW, How
from khr_view.page.reader import Later, by_reader, give_value

# Where a push sends the robot, in odom: the robot faces along x, y is to its left.
DIRECTIONS = {
    'forward': (1.0, 0.0),
    'backward': (-1.0, 0.0),
    'to its left': (0.0, 1.0),
    'to its right': (0.0, -1.0),
}
LARGEST_PUSH = 30.0  # N that the page offers
GROUPS = ('Feedback', 'Ground', 'Push', 'Time', 'Scenario')
AT_THE_END = ('begin again, same seed', 'begin again, next seed', 'stay')
PAUSE, RESET, PUSH = ('Pause', 'Go on'), 'Reset to time 0', 'Push'  # what the buttons say
OF_SYNC = {'lockstep': 'pace', 'realtime': 'realtime_factor'}  # what sets the speed


class LivePanel:
    """Pause, reset, scenario, sliders of parameters, pushes.

    Args:
        server: viser's.
        later: has the owner of the run do what the reader wants.
        owner: whose methods change, pause, reset, repeat, switch and push do so.
        scenarios: names of those that can be switched to.
        again: how a run that is over begins again.
    """

    def __init__(
        self, server: Any, later: Later, owner: Any, scenarios: Sequence[str], again: How
    ) -> None:
        self._server, self._later, self._owner = server, later, owner
        self._gui = gui = server.gui
        self._handles: dict[tuple[str, str], Any] = {}
        self._folders: dict[str, Any] = {}
        self._paused, self._going, self._pausable = False, False, True
        self._pause = gui.add_button(PAUSE[False], icon='player-pause', disabled=True)
        self._pause.on_click(lambda _: later(owner.pause, not self._paused))
        self._reset = gui.add_button(RESET, icon='rotate', color='gray')
        self._reset.on_click(lambda _: later(owner.reset))
        words = dict(zip(HOW, AT_THE_END, strict=True))
        end = gui.add_dropdown('At the end', AT_THE_END, initial_value=words[again])
        end.on_update(lambda _: later(owner.repeat, HOW[AT_THE_END.index(end.value)]))
        for group in GROUPS:
            self._folders[group] = gui.add_folder(group)
        self._add_push()
        self._add_scenarios(scenarios)

    def show_state(self, state: str) -> None:
        """Name the button after what it does; only what runs or is paused can be halted."""
        self._going = state in ('running', 'paused')
        self._paused = state == 'paused'
        self._pause.icon = 'player-play' if self._paused else 'player-pause'
        self._show_pause()

    def show_offers(self, pause: bool, reset: bool, push: bool) -> None:
        """Disable the buttons of what the run's driver does not offer, which say so then."""
        self._pausable = pause
        self._show_pause()
        self._show(self._reset, reset, RESET if reset else 'No reset: the driver has none')
        self._show(self._push, push, PUSH if push else 'No push: the driver takes none')

    def _show_pause(self) -> None:
        name = PAUSE[self._paused] if self._pausable else 'No pause: the driver has none'
        self._show(self._pause, self._pausable and self._going, name)

    @staticmethod
    def _show(button: Any, enabled: bool, label: str) -> None:
        if button.disabled is enabled:
            button.disabled = not enabled
        if button.label != label:
            button.label = label

    def add(self, control: Control) -> None:
        """Add a control, or give the one that is there its value."""
        key = control.tunable.key
        if key in self._handles:
            self.show_value(control.tunable, control.value)
            return
        with self._folders[control.tunable.group]:
            handle = self._make(control)
        self._handles[key] = handle
        handle.on_update(by_reader(partial(self._later, self._owner.change, control.tunable)))

    def show_scenario(self, name: str) -> None:
        """Choose the scenario that runs, if it is one that can be switched to."""
        if name in self._scenario.options:
            give_value(self._server, self._scenario, name)

    def show_sync(self, sync: str) -> None:
        """Show the control of the speed that acts in this mode."""
        for mode, name in OF_SYNC.items():
            handle = self._handles.get(('simulator', name))
            if handle is not None:
                handle.visible = mode == sync

    def show_value(self, tunable: Tunable, value: Value) -> None:
        """Move a control to the value that its parameter has."""
        handle = self._handles.get(tunable.key)
        if handle is not None:
            give_value(self._server, handle, value)

    def _make(self, control: Control) -> Any:
        order = tunables().index(control.tunable)  # nodes answer in any order
        if control.minimum is None or control.maximum is None:
            return self._gui.add_checkbox(
                control.label, bool(control.value), hint=control.hint, order=order
            )
        return self._gui.add_slider(
            control.label,
            control.minimum,
            control.maximum,
            control.tunable.step,
            float(control.value),
            hint=control.hint,
            order=order,
        )

    def _add_push(self) -> None:
        with self._folders['Push']:
            force = self._gui.add_slider(
                'Force, N', 0.5, LARGEST_PUSH, 0.5, 5.0, hint='Or drag the torso.'
            )
            where = self._gui.add_dropdown('Direction', tuple(DIRECTIONS))
            self._push = self._gui.add_button(PUSH, icon='hand-finger')

        def on_click(_: Any) -> None:
            x, y = DIRECTIONS[where.value]
            self._later(self._owner.push, (force.value * x, force.value * y, 0.0), True)

        self._push.on_click(on_click)

    def _add_scenarios(self, scenarios: Sequence[str]) -> None:
        with self._folders['Scenario']:
            self._scenario = self._gui.add_dropdown('Scenario', tuple(scenarios))
            button = self._gui.add_button('Switch', icon='switch-horizontal', color='gray')
        button.on_click(lambda _: self._later(self._owner.switch, self._scenario.value))
