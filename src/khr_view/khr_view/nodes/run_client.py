"""Parameters and services of the nodes of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, cast

from rclpy.client import Client
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool

from khr_bringup.changes import Change
from khr_bringup.node_registry import table_of
from khr_common.errors import KhrError, MalformedError
from khr_common.interfaces import full_name
from khr_common.nodes.parameters import value_of
from khr_common.parameters import check
from khr_view.controls import Control, PendingChanges, Tunable, Value, control

GONE = 'the simulator does not answer; is the run still there?'


class RunClient:
    """Describe, read and change parameters of the nodes of the run, and pause it.

    No call blocks: answers arrive at the callbacks, or not at all.

    Args:
        node: of the clients; its executor calls the callbacks.
        tunables: the parameters.
        found: called with the control of each parameter that can change.
        changed: called with a parameter and its value once read, and when another client sets it.
        refused: called with a node's reason, and the parameter that keeps its value.
    """

    def __init__(
        self,
        node: Any,
        tunables: Sequence[Tunable],
        found: Callable[[Control], None],
        changed: Callable[[Tunable, Value], None],
        refused: Callable[[str], None],
    ) -> None:
        self._node, self._tunables = node, tunables
        self._found, self._changed, self._refused = found, changed, refused
        names = dict.fromkeys(each.place for each in tunables)
        self._clients = {name: AsyncParameterClient(node, name) for name in names}
        self._asked: set[str] = set()
        self._pending = PendingChanges()
        self._by_key = {each.key: each for each in tunables}
        self._pause: Client = node.create_client(SetBool, 'simulator/pause')

    def discover(self) -> None:
        """Request the changeable parameters of new nodes; called periodically."""
        for name, client in self._clients.items():
            if name not in self._asked and client.services_are_ready():
                self._asked.add(name)
                self._describe(name, client)

    def ask(self, tunable: Tunable, value: Value) -> bool:
        """Request a parameter change; the newest of several values wins.

        A value that the parameter does not accept is refused here, in the words of the command.

        Returns:
            Whether the parameter accepts it.
        """
        try:
            check(table_of(tunable.node), tunable.name, value)
        except KhrError as error:
            self._refused(f'{tunable.place}: {error}')
            self._restore(tunable)
            return False
        self._pending.ask(tunable.key, value)
        return True

    def send(self) -> None:
        """Send the requested values; those of a node that is still starting wait for it."""
        for key, value in self._pending.due(self._asked).items():
            self._send(self._by_key[key], value)

    @property
    def pausable(self) -> bool:
        """Return whether the run has a pause service."""
        return bool(self._pause.service_is_ready())

    def pause(self, halt: bool) -> None:
        """Pause or resume the run."""
        if not self._pause.service_is_ready():
            self._refused(GONE)
            return

        def answered(future: Any) -> None:
            response = future.result()
            self._refused('' if response.success else f'simulator: {response.message}')

        self._pause.call_async(SetBool.Request(data=halt)).add_done_callback(answered)

    def _describe(self, node: str, client: AsyncParameterClient) -> None:
        def listed(future: Any) -> None:
            known = set(future.result().result.names)
            mine = [each for each in self._tunables if each.place == node and each.name in known]
            names = [each.name for each in mine]

            def described(future: Any) -> None:
                descriptors = future.result().descriptors
                client.get_parameters(names).add_done_callback(
                    lambda future: self._on_values(mine, descriptors, future.result().values)
                )

            client.describe_parameters(names).add_done_callback(described)

        client.list_parameters().add_done_callback(listed)

    def _on_values(self, tunables: Sequence[Tunable], descriptors: Any, values: Any) -> None:
        for each, descriptor, value in zip(tunables, descriptors, values, strict=True):
            if each.key in self._pending:  # the reader changed it while the run started
                continue
            found = control(each, descriptor, value_of(value))
            if found is not None and each.group:
                self._found(found)
            else:
                self._changed(each, value_of(value))

    def _send(self, tunable: Tunable, value: Value) -> None:
        client = self._clients[tunable.place]
        if not client.services_are_ready():
            self._pending.answered(tunable.key, accepted=False)
            self._refused(f'{tunable.place}: no such node in the run')
            return
        future = client.set_parameters([Parameter(tunable.name, value=value)])

        def answered(future: Any) -> None:
            (result,) = future.result().results
            self._pending.answered(tunable.key, result.successful)
            self._refused('' if result.successful else f'{tunable.place}: {result.reason}')
            if not result.successful:
                self._restore(tunable)

        future.add_done_callback(answered)

    def _restore(self, tunable: Tunable) -> None:
        def read(future: Any) -> None:
            if tunable.key not in self._pending:  # the reader has changed it again
                self._changed(tunable, value_of(future.result().values[0]))

        self._clients[tunable.place].get_parameters([tunable.name]).add_done_callback(read)

    def on_changes(self, changes: Iterable[Change], robot: str = '') -> None:
        """Take the changes that nodes report, in a bout those of one robot.

        Raises:
            MalformedError: if a parameter does not accept its value.
        """
        for change in changes:
            tunable = self._by_key.get((full_name(robot, change.node), change.parameter))
            if tunable is None or self._pending.is_own(tunable.key, change.value):
                continue
            if tunable.key not in self._pending:
                self._changed(tunable, _checked(tunable, change.value))


def _checked(tunable: Tunable, value: Any) -> Value:
    try:
        accepted: Any = check(table_of(tunable.node), tunable.name, value)
    except KhrError as error:
        raise MalformedError(f'no value of {tunable.node}.{tunable.name}') from error
    return cast(Value, accepted)
