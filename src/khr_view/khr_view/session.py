"""The successive runs of one page: each is a run of its own, with its own folder."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, get_args

from khr_bringup.scenario.control_text import title_with_changes
from khr_bringup.scenario.scenario import (
    Scenario,
    find_scenario,
    parse,
    read_scenario,
    with_installed_engine,
)
from khr_common.errors import LONGEST
from khr_sim.run_parameters import RunParameters

SIMULATOR, ENGINE = 'simulator', 'engine'
OF_VIEW = ('pace', 'duration')  # parameters of the simulator that the command sets for every run
LASTING = ('gain', 'pace', 'realtime_factor')  # changes that also hold in another scenario
# At the end of a run: restart with the same seed, with the next one, or not.
EndAction = Literal['same', 'next', 'never']
END_ACTIONS: tuple[EndAction, ...] = get_args(EndAction)
PAUSE = 2.0  # s of wall time for which the end of a run is shown


class Session:
    """Hold the scenario of the present run, and of the next once a reader asks for one.

    Parameters changed on the page also apply to the next run: all of them if the scenario is the
    same, otherwise only gains and speed.

    Attributes:
        scenario: of the present run.
        next: of the next run; None if no next run is requested.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.next: Scenario | None = None
        self._base = scenario  # without the reader's changes
        self._changes: dict[tuple[str, str], Any] = {}

    def advance(self) -> bool:
        """Make the next scenario the present one; return whether there is one."""
        if self.next is None:
            return False
        self.scenario, self.next = self.next, None
        return True

    def end(self) -> None:
        """Drop the next scenario: the present run is the last."""
        self.next = None

    def keep(self, node: str, name: str, value: Any) -> None:
        """Keep a parameter that the reader has changed for the runs to come.

        That holds for the next run too, if it has been requested already.
        """
        self._changes[node, name] = value
        if self.next is not None and node in (SIMULATOR, *self._base.nodes):
            self._start(self._base, self._changes)

    def restart(self) -> None:
        """End the present run and start the same scenario again.

        Raises:
            KhrError: here and below, if the scenario is not accepted; then the run goes on.
        """
        self._start(self._base, self._changes)

    def next_seed(self) -> None:
        """End the present run and start the same scenario with the next seed."""
        seed = self.scenario.table(RunParameters).seed + 1
        seeds = {
            (node, 'seed'): seed for node, keys in self._base.values.items() if 'seed' in keys
        }
        self._start(self._base.changed(seeds | {(SIMULATOR, 'seed'): seed}), self._changes)

    def switch(self, name: str, text: str | None = None) -> None:
        """End the present run and start another scenario, on the same engine if it names none.

        Args:
            name: of the scenario.
            text: of its file; by default of the shipped scenario, or of the file, ``name``.
        """
        path = find_scenario(name) if text is None else None
        scenario = read_scenario(path) if path else parse(text or '', name, name)
        own, stated = self.scenario.whole(SIMULATOR), self.scenario.values.get(SIMULATOR, {})
        kept = {(SIMULATOR, key): own[key] for key in OF_VIEW}
        if ENGINE in stated and ENGINE not in scenario.values.get(SIMULATOR, {}):
            kept[SIMULATOR, ENGINE] = stated[ENGINE]
        base = with_installed_engine(scenario.changed(kept))
        nodes = [SIMULATOR, *base.nodes]
        self._start(
            base,
            {
                (node, key): value
                for (node, key), value in self._changes.items()
                if key in LASTING and node in nodes
            },
        )

    def _start(self, base: Scenario, changes: dict[tuple[str, str], Any]) -> None:
        made = {
            (node, name): value
            for (node, name), value in changes.items()
            if value != base.whole(node)[name]
        }
        shown = [f'{node}.{name}={value:g}' for (node, name), value in made.items()]
        changed = base.changed(made)
        self.next = replace(changed, title=title_with_changes(changed, shown)[:LONGEST])
        self._base, self._changes = base, dict(changes)


class RestartTimer:
    """Tell when a finished run is due to restart: once, after a pause."""

    def __init__(self) -> None:
        self._since: float | None = None  # wall time of the end, s

    def due(self, over: bool, now: float) -> bool:
        """Return whether the run restarts now.

        Args:
            over: whether the run is.
            now: wall time, s.
        """
        if not over:
            self._since = None
        elif self._since is None:
            self._since = now
        return self._since is not None and now - self._since >= PAUSE
