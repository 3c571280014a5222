"""The run on show, as far as the graph has reported it: state, outcome, parameters, motion."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from khr_bringup.scenario.scenario import parse, shipped, title_of
from khr_common.text.quoting import one_line
from khr_common.text.strict_yaml import read_file
from khr_sim.run_parameters import GAIT
from khr_view.controls import Tunable, Value
from khr_view.errors import ViewError
from khr_view.model.motion import GaitMotion, motion_in
from khr_view.model.status import Status
from khr_view.model.words import NO_RUN, in_words, over

SILENCE = 5.0  # s of wall time without a report of the simulator: the run is gone


class LiveRun:
    """Keep what is known of the run.

    Attributes:
        status: that the graph reports.
        now: simulated time of the newest sample, s.
        reported: wall time of the simulator's last report, s.
        trouble: what is wrong, for the reader; empty if nothing is.
    """

    def __init__(self) -> None:
        self.status = Status()
        self.now, self.reported = 0.0, time.monotonic()
        self.trouble = ''
        # Of what is known of the gait, once it is asked for.
        self._motion: GaitMotion | None = None
        self._known: dict[tuple[str, str], Value | str] = {}

    def learn(self, tunable: Tunable, value: Any) -> None:
        """Take the value that a parameter has."""
        self._known[tunable.key] = value
        if tunable.node == GAIT:
            self._motion = None
        elif tunable.key == ('recorder', 'scenario'):
            self.status.scenario = scenario_name(str(value))

    def of(self, node: str) -> dict[str, Any]:
        """Return what is known of a node's parameters."""
        return {name: value for (each, name), value in self._known.items() if each == node}

    @property
    def motion(self) -> GaitMotion:
        """Return the motion of the gait."""
        if self._motion is None:
            self._motion = motion_in(self.of(GAIT))
        return self._motion

    @property
    def over(self) -> bool:
        """Return whether the robot fell or its motion has ended."""
        return over(self._seen, self.motion, self.now)

    def in_words(self, again: str) -> str:
        """Return the state; ``again`` says how a run that is over begins again."""
        return in_words(self._seen, self.motion, self.now, again)

    def with_next_seed(self) -> str:
        """Return the scenario as it runs, gains as they are now, with the seed after its own.

        Raises:
            ViewError: if the run has no recorder, which alone knows the whole scenario.
            KhrError: if what is known does not make a scenario.
        """
        text = self._known.get(('recorder', 'scenario'))
        if not isinstance(text, str) or not text:
            raise ViewError('the next seed: only with a recorder; accepted: the same seed')
        scenario = parse(text, 'the scenario of the run', self.status.scenario)
        seed = scenario.of('simulator').get('seed', 0) + 1
        live = {
            key: value
            for key, value in self._known.items()
            if key[0] in scenario.values and key != ('recorder', 'scenario')
        }
        seeds = {(node, 'seed'): seed for node, keys in scenario.values.items() if 'seed' in keys}
        return scenario.changed(live | seeds | {('simulator', 'seed'): seed}).to_yaml()

    @property
    def known(self) -> bool:
        """Return whether there is a state to show: a reported one, or that none is reported."""
        return self.status.state != NO_RUN or self._silent

    @property
    def _silent(self) -> bool:
        return time.monotonic() - self.reported > SILENCE

    @property
    def _seen(self) -> Status:
        """Return the status, without a run if its simulator has been silent for too long."""
        if self._silent and self.status.state != 'finished':
            return replace(self.status, state=NO_RUN)
        return self.status


def scenario_name(text: str) -> str:
    """Return the name of the shipped scenario that one as run began from, or else its title.

    A run keeps a scenario under a name of its own (``scenario.yaml``), with its title.
    """
    title = title_of(text)
    named = (path.stem for path in shipped() if title_of(read_file(path)) == title)
    return one_line(next(named, title))
