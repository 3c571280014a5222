"""Parameters for the next run of a node, among them those that are fixed during one."""

from __future__ import annotations

import time
from typing import Any

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python

from khr_common.errors import KhrError
from khr_common.parameters import check

HELD = 60.0  # s of wall time; who prepares a run and then falls silent prepares none


class NextRun:
    """Hold parameters from when the node has accepted them until it begins another run.

    The service ``~/prepare`` takes them; parameters that it is not given stay as they are, and
    without any it forgets those that are held.

    Args:
        node: a :class:`~khr_common.nodes.node.KhrNode`.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self._held: dict[str, Any] = {}
        self._since = 0.0
        node.create_service(SetParametersAtomically, '~/prepare', self._on_prepare)

    def take(self) -> bool:
        """Give the node the parameters that are held; return whether there were any."""
        held, self._held = self._held, {}
        if not held or time.monotonic() - self._since > HELD:
            return False
        node = self._node
        parameters = [Parameter(name, value=value) for name, value in held.items()]
        # What is read-only is so during a run; this is where another begins. ROS has no public
        # call that sets such a parameter and still tells /parameter_events of it.
        node._set_parameters_atomically_common(
            parameters, {each.name: node.describe_parameter(each.name) for each in parameters}
        )
        return True

    def _on_prepare(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        self._held, self._since = {}, time.monotonic()
        given = {each.name: _plain(each.value) for each in request.parameters}
        response.result.successful = True
        try:
            values = {name: check(self._node.table, name, value) for name, value in given.items()}
            self._node.check_next(self._node.with_changes(values))
        except KhrError as error:
            response.result.successful, response.result.reason = False, str(error)
        else:
            self._held = values
        return response


def _plain(value: Any) -> Any:
    found = parameter_value_to_python(value)
    return list(found) if not isinstance(found, str) and hasattr(found, '__iter__') else found
