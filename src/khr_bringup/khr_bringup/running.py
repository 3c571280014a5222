"""A run of a scenario, as a graph or offline, from its folder to its result."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from khr_bringup.code_version import as_run
from khr_bringup.graph.graph import Callbacks, RunOptions, run_graph
from khr_bringup.graph.run_registry import RunEntry, check_domain, note, registered
from khr_bringup.offline import Watch, run_offline
from khr_bringup.result import Progress, Result
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.scenario import Scenario
from khr_common.files import write_text

if TYPE_CHECKING:
    from khr_bringup.offline import ControlLoop
    from khr_sim.physics.truth import Truth


def run_to_end(
    scenario: Scenario, folder: Path, options: RunOptions, callbacks: Callbacks
) -> Result:
    """Run a scenario to its end.

    Args:
        scenario: what to run.
        folder: that is claimed for it; the scenario as run is written to it, and by a graph its
            recording and what its processes print.
        options: how to run it.
        callbacks: to call meanwhile.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if the run could not go on.
    """
    check_domain(options.domain)
    if options.offline:
        write_text(folder / SCENARIO, as_run(scenario))
        return run_offline(scenario, showing(callbacks.show))
    with registered(scenario.name, folder, options.domain, options.network) as entry:
        callbacks.begun(entry)
        noted = replace(callbacks, show=noting(entry, callbacks.show))
        return run_graph(scenario, folder, entry, options, noted)


def noting(entry: RunEntry, show: Callable[[Progress], None]) -> Callable[[Progress], None]:
    """Return what shows progress, and keeps the run's state and scenario in the register."""
    noted = entry

    def show_and_note(progress: Progress) -> None:
        nonlocal noted
        now = replace(entry, state=progress.state, scenario=progress.scenario or entry.scenario)
        if now != noted:
            noted = now
            note(noted)
        show(progress)

    return show_and_note


def showing(show: Callable[[Progress], None]) -> Watch:
    """Return what looks on at a run offline and shows its progress."""
    began = time.monotonic()

    def watch(truth: Truth, loop: ControlLoop, _: object) -> None:
        seconds = truth.stamp_ns / 1e9
        factor = seconds / (time.monotonic() - began + 1e-9)
        show(Progress(seconds, 'offline', factor, loop.pitch_rate))

    return watch
