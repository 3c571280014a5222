"""Parameters for the next run of a node, among them those that are fixed during one."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter

from khr_common.errors import KhrError
from khr_common.nodes.ros_parameters import value_of
from khr_common.parameters import check

HELD = 60.0  # s of wall time after which prepared parameters expire


class NextRun:
    """Hold parameters from when the node has accepted them until it begins another run.

    The service ``~/prepare`` takes them; parameters that it is not given stay as they are, and
    without any it forgets those that are held.

    Args:
        node: whose parameters they are.
        table: of the node's parameters.
        check_all: called with what a request changes; it raises KhrError unless the node could
            run with it.
    """

    def __init__(
        self, node: Node, table: type[Any], check_all: Callable[[dict[str, Any]], None]
    ) -> None:
        self._node, self._table, self._check_all = node, table, check_all
        self._held: dict[str, Any] = {}
        self._since = 0.0
        node.create_service(SetParametersAtomically, '~/prepare', self._on_prepare)

    def hold(self, values: dict[str, Any]) -> None:
        """Hold parameters that have been checked, in the place of those held before."""
        self._held, self._since = values, time.monotonic()

    def take(self) -> bool:
        """Give the node the parameters that are held; return whether there were any."""
        held, self._held = self._held, {}
        if not held or time.monotonic() - self._since > HELD:
            return False
        self._node.set_parameters_atomically(
            [Parameter(name, value=value) for name, value in held.items()]
        )
        return True

    def _on_prepare(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        self.hold({})
        given = {each.name: value_of(each.value) for each in request.parameters}
        response.result.successful = True
        try:
            values = {name: check(self._table, name, value) for name, value in given.items()}
            self._check_all(values)
        except KhrError as error:
            response.result.successful, response.result.reason = False, str(error)
        else:
            self.hold(values)
        return response
