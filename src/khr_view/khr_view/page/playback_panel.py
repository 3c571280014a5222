"""The controls of recorded runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from khr_view.page.reader import Later, give_value, on_user_input

SPEEDS = ('0.05', '0.1', '0.25', '0.5', '1', '2', '5')
MOST_MARKS = 200  # that are listed
START = '0.00 s  start'


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
