"""The controls of a live run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from khr_view.controls import TUNABLES, Control, Tunable, Value
from khr_view.events import Changed, Pause, Pushed, Reset, Switch

Emit = Callable[[object], None]
# Where a push sends the robot, in odom: the robot faces along x, y is to its left.
DIRECTIONS = {
    'forward': (1.0, 0.0),
    'backward': (-1.0, 0.0),
    'to its left': (0.0, 1.0),
    'to its right': (0.0, -1.0),
}
LARGEST_PUSH = 30.0  # N that the page offers
GROUPS = ('Feedback', 'Ground', 'Push', 'Time', 'Scenario')
OF_SYNC = {'lockstep': 'pace', 'realtime': 'realtime_factor'}  # what sets the speed


class LivePanel:
    """Pause, reset, scenario, sliders of parameters, pushes.

    Args:
        gui: viser's.
        emit: called with each event.
        scenarios: names of those that can be switched to.
    """

    def __init__(self, gui: Any, emit: Emit, scenarios: Sequence[str]) -> None:
        self._gui, self._emit = gui, emit
        self._handles: dict[tuple[str, str], Any] = {}
        self._folders: dict[str, Any] = {}
        self._paused = False
        self._pause = gui.add_button('Pause', icon='player-pause')
        self._pause.on_click(lambda _: emit(Pause(not self._paused)))
        reset = gui.add_button('Reset to time 0', icon='rotate', color='gray')
        reset.on_click(lambda _: emit(Reset()))
        for group in GROUPS:
            self._folders[group] = gui.add_folder(group)
        self._add_push()
        self._add_scenarios(scenarios)

    def show_paused(self, paused: bool) -> None:
        """Name the button after what it does."""
        if paused != self._paused:
            self._paused = paused
            self._pause.label = 'Go on' if paused else 'Pause'
            self._pause.icon = 'player-play' if paused else 'player-pause'

    def add(self, control: Control) -> None:
        """Add a control, or give the one that is there its value."""
        key = control.tunable.key
        if key in self._handles:
            self.show_value(control.tunable, control.value)
            return
        with self._folders[control.tunable.group]:
            handle = self._make(control)
        self._handles[key] = handle

        def on_update(event: Any) -> None:
            if event.client is not None:  # the reader's doing, not ours
                self._emit(Changed(control.tunable, event.target.value))

        handle.on_update(on_update)

    def show_scenario(self, name: str) -> None:
        """Choose the scenario that runs, if it is one that can be switched to."""
        if name in self._scenario.options:
            self._scenario.value = name

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
            handle.value = value

    def _make(self, control: Control) -> Any:
        order = TUNABLES.index(control.tunable)  # nodes answer in any order
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
            button = self._gui.add_button('Push', icon='hand-finger')

        def on_click(_: Any) -> None:
            x, y = DIRECTIONS[where.value]
            self._emit(Pushed((force.value * x, force.value * y, 0.0)))

        button.on_click(on_click)

    def _add_scenarios(self, scenarios: Sequence[str]) -> None:
        with self._folders['Scenario']:
            self._scenario = self._gui.add_dropdown('Scenario', tuple(scenarios))
            button = self._gui.add_button('Switch', icon='switch-horizontal', color='gray')
        button.on_click(lambda _: self._emit(Switch(self._scenario.value)))
