"""Another scenario on a live graph: taken as a whole, or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import rclpy
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from khr_bringup.errors import BringupError
from khr_bringup.node_registry import registry
from khr_bringup.offline import duration
from khr_bringup.scenario.scenario import Scenario
from khr_common.files import write_text
from khr_common.nodes.ros_parameters import to_set, value_of

PATIENCE = 5.0  # s of wall time for a node to answer
RECORDER, SIMULATOR = 'recorder', 'simulator'
# How the graph runs, which another scenario does not change.
KEPT = {
    SIMULATOR: (
        'answers',
        'listeners',
        'start_timeout',
        'lockstep_timeout',
        'sync',
        'realtime_factor',
        'pace',
        'gui',
        'duration',
    ),
    'monitor': ('judge_by',),
}


def switch(scenario: Scenario, own: Any, folder: Path | None = None) -> Scenario:
    """Have all nodes prepare for a scenario; once all have accepted it, start the run anew.

    Args:
        scenario: to switch to.
        own: a node in the graph that no executor spins meanwhile.
        folder: of the run, in which the scenario is kept; nowhere if left out.

    Returns:
        The scenario with what the graph adds, as it runs now.

    Raises:
        BringupError: if the graph lacks a node that the scenario needs, or one refuses or does
            not answer; then all is as before.
    """
    graph = _Graph(own)
    live = [name for name in registry() if name in graph.names]
    keeper = scenario.driver.first if scenario.driver else SIMULATOR
    lacking = [name for name in scenario.nodes if name not in live and name != RECORDER]
    if lacking:
        raise BringupError(
            f'{scenario.name}: needs {", ".join(lacking)}, which the graph does not run; '
            'accepted: a scenario with the nodes that it has'
        )
    text = scenario.to_yaml()
    file = _write(text, folder) if folder else None
    prepared: list[str] = []
    lasts = duration(scenario)
    try:
        for node in live:
            if node == 'page':
                continue
            prepared.append(node)
            values = _values(scenario, node, keeper)
            if node == RECORDER:
                values = {'scenario': text}
            elif node == keeper and graph.get(keeper, 'duration'):  # it does not go on
                values['duration'] = lasts
            graph.prepare(node, values)
        graph.reset()
    except BringupError:
        for node in prepared:
            with suppress(BringupError):
                graph.prepare(node, {})
        if file is not None:
            file.unlink(missing_ok=True)
        raise
    return scenario.changed({(SIMULATOR, 'duration'): lasts})


def _values(scenario: Scenario, node: str, keeper: str) -> dict[str, Any]:
    kept = KEPT.get(SIMULATOR if node == keeper else node, ())
    return {key: value for key, value in scenario.whole(node).items() if key not in kept}


def _write(text: str, folder: Path) -> Path:
    """Keep the scenario beside the bag whose ``/scenario`` it becomes."""
    number = 2
    while (file := folder / f'scenario_{number}.yaml').exists():
        number += 1
    write_text(file, text)
    return file


class _Graph:
    """The services of a graph, each called and waited for."""

    def __init__(self, node: Any) -> None:
        self._node, self._client = node, cache(node.create_client)
        self._executor = SingleThreadedExecutor(context=node.context)
        namespace = node.get_namespace()
        self.names = {
            name for name, where in node.get_node_names_and_namespaces() if where == namespace
        }
        for name in self.names & set(registry()):  # that they find one another all at once
            self._client(SetParametersAtomically, f'{name}/prepare')

    def get(self, node: str, name: str) -> Any:
        """Return a parameter of a node."""
        request = GetParameters.Request(names=[name])
        (value,) = self._call(GetParameters, f'{node}/get_parameters', request).values
        return value_of(value)

    def prepare(self, node: str, values: Mapping[str, Any]) -> None:
        """Have a node prepare for another run; without values it forgets what it prepared for."""
        result = self._call(SetParametersAtomically, f'{node}/prepare', to_set(values)).result
        if not result.successful:
            raise BringupError(f'{node}: {result.reason}')

    def reset(self) -> None:
        """Start the run anew."""
        response = self._call(Trigger, f'{SIMULATOR}/reset', Trigger.Request())
        if not response.success:
            raise BringupError(f'{SIMULATOR}: {response.message}')

    def _call(self, kind: Any, name: str, request: Any) -> Any:
        client = self._client(kind, name)
        future = client.call_async(request) if client.wait_for_service(PATIENCE) else None
        if future is not None:
            rclpy.spin_until_future_complete(self._node, future, self._executor, PATIENCE)
        if future is None or not future.done():
            raise BringupError(f'{name}: no answer within {PATIENCE:g} s')
        return future.result()
