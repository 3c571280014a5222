"""Parameters of a running graph, over the ordinary parameter services."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

import yaml

from khr_bringup.graph.run_registry import WITHOUT_LOG, choose
from khr_bringup.node_registry import registry, table_of
from khr_bringup.scenario.parameter_file import parse_value
from khr_common import ParameterError, check, specifications
from khr_common.errors import KhrError, meant, named, quoted
from khr_common.strict_yaml import read_yaml

if TYPE_CHECKING:
    from khr_bringup.scenario.scenario import Scenario

PATIENCE = 5.0  # s of wall time for a node to appear, and again to answer


@dataclass(frozen=True)
class LiveParameter:
    """A parameter of a running node."""

    # name, value: of the parameter
    name: str
    value: Any
    meaning: str  # with its unit and accepted values, from the descriptor
    fixed: bool = False  # whether it cannot change while the node runs

    @property
    def as_yaml(self) -> str:
        """Return the value as YAML, as accepted by ``khr set``."""
        # In a list, because YAML marks the end of a document that is a bare scalar.
        return yaml.safe_dump([self.value], default_flow_style=True, width=inf).strip()[1:-1]

    def read(self, node: str, text: str) -> Any:
        """Read another value of it from YAML, of its type where YAML leaves that open.

        The tables of all nodes need not be imported for it, except for an empty list.
        """
        value = read_yaml(text, named(f'{node}.{self.name}'))
        if isinstance(self.value, str) and not isinstance(value, str):
            return text
        if isinstance(self.value, float) and type(value) is int:
            return float(value)
        if isinstance(self.value, list) and isinstance(value, list):
            if not self.value:
                return parse_value(node.rpartition('/')[2], self.name, text)
            if isinstance(self.value[0], float):
                return [float(each) if type(each) is int else each for each in value]
        return value


def get_parameters(
    node: str, name: str | None, domain: int | None = None, timeout: float = PATIENCE
) -> list[LiveParameter]:
    """Return one parameter of a node, or all of them.

    Args:
        node: its name, with the robot's in a bout, such as ``red/gait``.
        name: of the parameter; all by default.
        domain: of the run, if there are several.
        timeout: s of wall time for the node to appear, and again for each answer.

    Raises:
        KhrError: if no run, node or parameter of that name is there, or no answer comes.
    """
    with _client(node, domain, timeout) as call:
        return _get(call, node, name)


def set_parameter(
    node: str, name: str, text: str, domain: int | None = None, timeout: float = PATIENCE
) -> tuple[LiveParameter, LiveParameter]:
    """Change a parameter of a node to a value in YAML; return it before and after the change.

    Raises:
        KhrError: as above, or if it is no YAML, or the node refuses the value.
    """
    from rclpy.parameter import Parameter

    with _client(node, domain, timeout) as call:
        (before,) = _get(call, node, name)
        value = before.read(node, text)
        if before.fixed:
            check_change(node, before, value)
        try:
            parameter = Parameter(name, value=value)
        except (TypeError, ValueError, AssertionError) as error:
            raise KhrError.refused(
                f'{node}: {name}', value, f'a value like {before.as_yaml}'
            ) from error
        result = call('set_parameters', [parameter]).results[0]
        if not result.successful:
            check_change(node, before, value)
            raise KhrError(f'{node}: {result.reason or f"{name} cannot change now"}')
        (after,) = _get(call, node, name)
        return before, after


def check_change(node: str, parameter: LiveParameter, value: Any) -> None:
    """Refuse a value that the node would refuse, with the text of a scenario file."""
    name = parameter.name
    if parameter.fixed:
        raise KhrError(
            f'{node}: {name}: {quoted(value)} is not accepted: fixed at {parameter.as_yaml} while it '
            f'runs; accepted: khr run --set {node}.{name}=VALUE'
        )
    own = node.rpartition('/')[2]
    if own in registry() and name in specifications(table_of(own)):
        try:
            check(table_of(own), name, value)
        except ParameterError as error:
            raise KhrError(f'{node}: {error}') from error


def switch_scenario(scenario: Scenario, domain: int | None = None) -> str:
    """Have ``khr view`` end its run and start another scenario; return the title of the run.

    Raises:
        KhrError: if there is no such run, or the scenario is refused; then the run goes on.
    """
    from rcl_interfaces.srv import SetParametersAtomically

    from khr_common.nodes.parameters import to_set

    entry = choose(domain)
    request = to_set({'name': scenario.name, 'scenario': scenario.stated_to_yaml()})
    answer = _answer(domain, SetParametersAtomically, 'khr/switch', request)
    if answer is None:
        raise KhrError('khr: no answer; is the run still there?')
    if not answer.result.successful:
        raise KhrError(answer.result.reason)
    return entry.title


def call_trigger(service: str, domain: int | None = None) -> str:
    """Call a service of the type ``std_srvs/srv/Trigger`` in a running graph; return its answer.

    Raises:
        KhrError: if there is no run or no such service, or it refuses.
    """
    from std_srvs.srv import Trigger

    answer = _answer(domain, Trigger, service, Trigger.Request())
    if answer is None:
        raise KhrError(f'{service}: no answer within {PATIENCE:g} s; is the node there?')
    if not answer.success:
        raise KhrError(f'{service}: {answer.message}')
    return str(answer.message)


def _answer(domain: int | None, kind: Any, service: str, request: Any) -> Any:
    """Return the response of a service; None if it is not there, or does not respond in time."""
    with _join_run(domain) as own:
        import rclpy

        client = own.create_client(kind, service)
        if not client.wait_for_service(PATIENCE):
            return None
        future = client.call_async(request)
        rclpy.spin_until_future_complete(own, future, timeout_sec=PATIENCE)
        return future.result() if future.done() else None


def _get(call: Any, node: str, name: str | None) -> list[LiveParameter]:
    from khr_common.nodes.parameters import value_of

    names = sorted(call('list_parameters').result.names)
    if name is not None and name not in names:
        raise KhrError(
            f'{node}: {name}: no such parameter; {meant(name, names)}accepted: {", ".join(names)}'
        )
    wanted = names if name is None else [name]
    values = map(value_of, call('get_parameters', wanted).values)
    descriptors = call('describe_parameters', wanted).descriptors
    return [
        LiveParameter(key, value, _meaning(each), each.read_only)
        for key, value, each in zip(wanted, values, descriptors, strict=True)
    ]


def _meaning(descriptor: Any) -> str:
    parts = (descriptor.description, descriptor.additional_constraints)
    fixed = ('fixed while it runs',) if descriptor.read_only else ()
    return '; '.join(part.rstrip('.') for part in (*parts, *fixed) if part)


@contextmanager
def _client(node: str, domain: int | None, timeout: float) -> Iterator[Any]:
    """Yield a function that calls a parameter service of ``node`` in the run of ``domain``."""
    import rclpy
    from rclpy.parameter_client import AsyncParameterClient

    with _join_run(domain) as own:
        client = AsyncParameterClient(own, node)
        if not client.wait_for_services(timeout):
            known = sorted(
                f'{space.lstrip("/")}/{name}'.lstrip('/')
                for name, space in own.get_node_names_and_namespaces()
                if not name.startswith(('khr', '_'))
            )
            raise KhrError(
                f'{node}: no such node in the running graph within {timeout:g} s; '
                f'{meant(node, known)}accepted: '
                f'{", ".join(known) or "a run that goes on (khr list); this one has ended"}'
            )

        def call(service: str, *arguments: Any) -> Any:
            future = getattr(client, service)(*arguments)
            rclpy.spin_until_future_complete(own, future, timeout_sec=timeout)
            if not future.done():
                raise KhrError(f'{node}: no answer within {timeout:g} s')
            return future.result()

        yield call


@contextmanager
def _join_run(domain: int | None) -> Iterator[Any]:
    """Yield a node in the run of ``domain``."""
    os.environ.update(choose(domain).quiet_environment())
    import rclpy

    rclpy.init(args=WITHOUT_LOG)
    own = rclpy.create_node('khr_parameters', start_parameter_services=False)
    try:
        yield own
    finally:
        own.destroy_node()
        rclpy.try_shutdown()
