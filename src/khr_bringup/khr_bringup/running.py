"""A run of a scenario, as a graph or offline, from its folder to its result."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from khr_bringup.code_version import as_run
from khr_bringup.graph.following import Callbacks
from khr_bringup.graph.graph import RunOptions, run_graph
from khr_bringup.graph.run_registry import RunEntry, registered
from khr_bringup.graph.wiring import Robots
from khr_bringup.offline import Watch, run_offline
from khr_bringup.result import Progress, Result
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.scenario import Scenario
from khr_common.files import write_text

if TYPE_CHECKING:
    from khr_bringup.offline import ControlLoop
    from khr_sim.physics.truth import GroundTruth


def run_to_end(
    scenario: Scenario,
    folder: Path,
    options: RunOptions,
    callbacks: Callbacks,
    session: RunEntry | None = None,
) -> Result:
    """Run a scenario to its end.

    Args:
        scenario: to run.
        folder: claimed for the run; it receives the scenario, and of a graph the recording and the
            logs of its processes.
        options: how to run it.
        callbacks: to call meanwhile.
        session: a registered entry with the ROS domain of the run; by default a new one.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if the run could not go on.
    """
    if options.offline:
        write_text(folder / SCENARIO, as_run(scenario))
        return run_offline(scenario, offline_progress(callbacks.progress))
    with (
        registered(scenario.name, folder, options.domain, options.network)
        if session is None
        else nullcontext(session.next_run(scenario.name, folder))
    ) as entry:
        callbacks.started(entry)
        (result,) = run_graph(Robots.alone(scenario), folder, entry, options, callbacks)
        return result


def offline_progress(show: Callable[[Progress], None]) -> Watch:
    """Return a callback that shows the progress of an offline run."""
    began = time.monotonic()

    def watch(truth: GroundTruth, loop: ControlLoop, _: object) -> None:
        seconds = truth.stamp_ns / 1e9
        factor = seconds / (time.monotonic() - began + 1e-9)
        show(Progress(seconds, 'offline', factor, loop.pitch_rate))

    return watch
