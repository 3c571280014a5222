"""The controls of live and of recorded runs."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass
from typing import Any

from khr_bringup.scenario.scenario import Scenario
from khr_common import check, parameter, specifications
from khr_common.errors import KhrError
from khr_view.controls import Control, Tunable, Value, tunables
from khr_view.session import END_ACTIONS, EndAction

Later = Callable[..., None]  # has a function called with the values that follow it
# Where a push sends the robot, in odom: the robot faces along x, y is to its left.
DIRECTIONS = {
    'forward': (1.0, 0.0),
    'backward': (-1.0, 0.0),
    'to its left': (0.0, 1.0),
    'to its right': (0.0, -1.0),
}
IN_RING = dict(
    zip(('along x', 'against x', 'along y', 'against y'), DIRECTIONS.values(), strict=True)
)
SIMULATOR = 'simulator'
FEEDBACK = 'Feedback'
GROUPS = (FEEDBACK, 'Ground', 'Push', 'Time')
AT_THE_END = ('restart, same seed', 'restart, next seed', 'stay')
PAUSE, RESTART, PUSH = ('Pause', 'Go on'), 'Restart', 'Push'  # labels of the buttons
OF_SYNC = {'lockstep': 'pace', 'realtime': 'realtime_factor'}  # the parameter of the speed
SPEEDS = ('0.05', '0.1', '0.25', '0.5', '1', '2', '5')
MOST_MARKS = 200  # that are listed
START = '0.00 s  start'


def on_user_input(act: Callable[[Any], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """Wrap a control's callback so that only values set by a user reach it.

    The callback is a coroutine, which viser awaits at once. viser calls a plain function later in
    another thread, when the program may have overwritten the user's value.
    """

    async def on_update(event: Any) -> None:
        if event.client is not None:
            act(event.target.value)

    return on_update


def give_value(
    server: Any, control: Any, value: Any, still: Callable[[], bool] = lambda: True
) -> None:
    """Set the value of a control, but not between a user's change and its callback.

    Args:
        server: viser's.
        control: that gets the value.
        value: its new one.
        still: whether the value is still to be set, asked in the thread of the callbacks.
    """

    def give() -> None:
        if still():
            control.value = value

    server.get_event_loop().call_soon_threadsafe(give)


@dataclass(frozen=True)
class PushForce:
    """The push that the page offers."""

    force: float = parameter(5.0, 'Or drag the torso.', '[0.5, 30] N')


class LivePanel:
    """Pause, restart, scenario, sliders of parameters, pushes.

    Args:
        server: viser's.
        later: queues a call for the thread of the run.
        scenarios: names of the scenarios that can be started; without any it has no restart.
        at_the_end: the action that follows the end of a run.
        robots: names of the robots of a bout, which have controls apart.
    """

    _owner: Any  # of the present run

    def __init__(
        self,
        server: Any,
        later: Later,
        scenarios: Sequence[str],
        at_the_end: EndAction,
        robots: Sequence[str] = (),
    ) -> None:
        self._robots = tuple(robots)
        self._server, self._later = server, later
        self._gui = gui = server.gui
        self._handles: dict[tuple[str, str], Any] = {}
        self._queued: list[tuple[str, str]] = []  # changes by the reader; two threads use it
        self._folders: dict[str, Any] = {}
        self._paused, self._going, self._pausable = False, False, True
        self._pause = gui.add_button(PAUSE[False], icon='player-pause', disabled=True)
        self._pause.on_click(lambda _: later(lambda: self._owner.pause(not self._paused)))
        if scenarios:
            self._add_restart(at_the_end)
        for group in GROUPS:
            shared = group != FEEDBACK or not robots
            for name in [group] if shared else [f'{group}, {robot}' for robot in robots]:
                self._folders[name] = gui.add_folder(name)
        self._add_push()
        if scenarios:
            self._add_scenarios(scenarios)

    def begin(self, owner: Any, scenario: Scenario | None) -> None:
        """Serve another run; controls of nodes that it does not have disappear.

        Args:
            owner: has the methods that the controls call: change, pause, push, show_refusal, and
                for pages that restart runs also restart, at_the_end and switch.
            scenario: of the run, if it is known.
        """
        self._owner = owner
        if scenario is None:
            return
        for (node, _), handle in self._handles.items():
            if node != SIMULATOR:
                handle.visible = node in scenario.nodes
        if scenario.name in self._scenario.options:
            give_value(self._server, self._scenario, scenario.name)

    def _add_restart(self, at_the_end: EndAction) -> None:
        button = self._gui.add_button(RESTART, icon='rotate', color='gray')
        button.on_click(lambda _: self._later(lambda: self._owner.restart()))
        labels = dict(zip(END_ACTIONS, AT_THE_END, strict=True))
        end = self._gui.add_dropdown('At the end', AT_THE_END, initial_value=labels[at_the_end])
        end.on_update(
            lambda _: self._later(
                lambda: self._owner.at_the_end(END_ACTIONS[AT_THE_END.index(end.value)])
            )
        )

    def show_state(self, state: str) -> None:
        """Label the button by its action; only a running or paused run can be halted."""
        self._going = state in ('running', 'paused')
        self._paused = state == 'paused'
        self._pause.icon = 'player-play' if self._paused else 'player-pause'
        self._show_pause()

    def show_offers(self, pause: bool, push: bool) -> None:
        """Disable the buttons that the driver of the run does not support, and label them so."""
        self._pausable = pause
        self._show_pause()
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
        """Add a control, or give an existing one its value."""
        key = control.tunable.key
        if key in self._handles:
            self.show_value(control.tunable, control.value)
            return
        with self._folders[control.tunable.group]:
            handle = self._make(control)
        self._handles[key] = handle
        handle.on_update(on_user_input(lambda value: self._change(control.tunable, value)))

    def _change(self, tunable: Tunable, value: Value) -> None:
        def act() -> None:
            try:
                self._owner.change(tunable, value)
            finally:
                self._queued.remove(tunable.key)

        self._queued.append(tunable.key)
        self._later(act)

    def show_sync(self, sync: str) -> None:
        """Show the control of the speed that acts in this mode."""
        for mode, name in OF_SYNC.items():
            handle = self._handles.get(('simulator', name))
            if handle is not None:
                handle.visible = mode == sync

    def show_value(self, tunable: Tunable, value: Value) -> None:
        """Move a control to the value of its parameter, unless the reader has just changed it."""
        handle = self._handles.get(tunable.key)
        if handle is not None:
            give_value(self._server, handle, value, lambda: tunable.key not in self._queued)

    def _make(self, control: Control) -> Any:
        # Nodes answer in any order.
        order = [(each.node, each.name) for each in tunables()].index(
            (control.tunable.node, control.tunable.name)
        )
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
        of = specifications(PushForce)['force']
        with self._folders['Push']:
            force = self._gui.add_slider(
                f'Force, {of.unit}', of.minimum, of.maximum, 0.5, of.default, hint=of.description
            )
            directions = IN_RING if self._robots else DIRECTIONS
            robot = self._gui.add_dropdown('Robot', self._robots) if self._robots else None
            where = self._gui.add_dropdown('Direction', tuple(directions))
            self._push = self._gui.add_button(PUSH, icon='hand-finger')

        def accepted(value: float) -> bool:
            try:
                check(PushForce, 'force', value)
            except KhrError as error:
                self._owner.show_refusal(f'push: {error}')
                give_value(self._server, force, of.default)
                return False
            return True

        def push(value: float) -> None:
            x, y = directions[where.value]
            if accepted(value):
                name = robot.value if robot is not None else ''
                self._owner.push((value * x, value * y, 0.0), True, name)

        force.on_update(on_user_input(lambda value: self._later(accepted, value)))
        self._push.on_click(lambda _: self._later(push, force.value))

    def _add_scenarios(self, scenarios: Sequence[str]) -> None:
        with self._gui.add_folder('Scenario'):
            self._scenario = self._gui.add_dropdown('Scenario', tuple(scenarios))
            button = self._gui.add_button('Switch', icon='switch-horizontal', color='gray')
        button.on_click(lambda _: self._later(lambda: self._owner.switch(self._scenario.value)))


class PlaybackPanel:
    """A time line, play and pause, single steps, speed, loop, and a list of events.

    Args:
        server: viser's.
        later: queues an action for the player.
        player: of the runs.
        runs: with the marks to list.
    """

    def __init__(self, server: Any, later: Later, player: Any, runs: Sequence[Any]) -> None:
        self._server, gui = server, server.gui
        self._playing, self._shown = player.playing, 0.0
        label, icon = self._name(player.playing)
        self._play = gui.add_button(label, icon=icon)
        self._play.on_click(lambda _: later(player.play, not self._playing))
        end = max(player.end, player.period)
        self._time = gui.add_slider('Time, s', 0.0, end, player.period, 0.0)
        steps = gui.add_button_group('Step', ('back', 'forward'))
        speed = gui.add_dropdown('Speed, times real time', SPEEDS, initial_value='1')
        loop = gui.add_checkbox('Begin again at the end', player.loop)
        marks = _marks(runs)
        places = gui.add_dropdown('Go to', tuple(marks))
        self._time.on_update(on_user_input(lambda value: later(player.seek, value)))
        steps.on_click(
            on_user_input(lambda value: later(player.step, 1 if value == 'forward' else -1))
        )
        speed.on_update(on_user_input(lambda value: later(setattr, player, 'speed', float(value))))
        loop.on_update(on_user_input(lambda value: later(setattr, player, 'loop', value)))
        places.on_update(on_user_input(lambda value: later(player.seek, marks[value])))

    def show(self, player: Any) -> None:
        """Move the time line, and label the button by its action."""
        now = min(player.now, self._time.max)
        if now != self._shown:  # else the reader may just have moved it
            self._shown = now
            give_value(self._server, self._time, now)
        if player.playing != self._playing:
            self._playing = player.playing
            self._play.label, self._play.icon = self._name(player.playing)

    @staticmethod
    def _name(playing: bool) -> tuple[str, Any]:
        return ('Pause', 'player-pause') if playing else ('Play', 'player-play')


def _marks(runs: Sequence[Any]) -> dict[str, float]:
    """Return the times of events, by their text in the list."""
    found = {START: 0.0}
    for run in runs:
        of = f' ({run.name})' if len(runs) > 1 else ''
        for mark in run.marks[:MOST_MARKS]:
            found[f'{mark.time:.2f} s  {mark.text}{of}'] = mark.time
    return found
