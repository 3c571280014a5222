"""ROS parameters: a node with one parameter table, plain values, descriptors."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.exceptions import ParameterException, ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python

from khr_common.errors import KhrError
from khr_common.parameter_files import check_blocks, files_in, read_blocks
from khr_common.parameters import (
    LARGEST,
    ParameterError,
    Specification,
    build,
    check,
    specifications,
)

# Parameters that every node of ROS 2 has.
OF_ROS = ('use_sim_time', 'start_type_description_service')


def plain(value: Any) -> Any:
    """Return a list for an ``array.array`` of ROS, and any other value as it is."""
    return list(value) if not isinstance(value, str) and hasattr(value, '__iter__') else value


def value_of(message: Any) -> Any:
    """Return the plain value that a rcl_interfaces/ParameterValue holds."""
    return plain(parameter_value_to_python(message))


def to_set(values: Mapping[str, Any]) -> SetParametersAtomically.Request:
    """Return a SetParametersAtomically request, which ``khr/switch`` and the like use as well."""
    return SetParametersAtomically.Request(
        parameters=[
            Parameter(name, value=each).to_parameter_msg() for name, each in values.items()
        ]
    )


def describe(specification: Specification) -> ParameterDescriptor:
    """Return how ROS describes a parameter: its meaning, unit and range."""
    text = specification.description
    if specification.unit:
        text += f' [{specification.unit}]'
    descriptor = ParameterDescriptor(
        name=specification.name,
        description=text,
        additional_constraints=f'accepted: {specification.accepted}',
        read_only=specification.read_only,
    )
    low, high = specification.minimum, specification.maximum
    if specification.element is not None or (low is None and high is None):
        return descriptor  # a descriptor has no range for lists: the text has it
    if specification.kind is float:
        most = sys.float_info.max
        descriptor.floating_point_range = [
            FloatingPointRange(
                from_value=-most if low is None else float(low),
                to_value=most if high is None else float(high),
            )
        ]
    elif specification.kind is int:
        descriptor.integer_range = [
            IntegerRange(
                from_value=-LARGEST if low is None else int(low),
                to_value=LARGEST if high is None else int(high),
            )
        ]
    return descriptor


class ParameterNode(Node):  # type: ignore[misc]
    """A node with the fields of a table as its parameters; it passes on every accepted change.

    Args:
        name: of the node.
        namespace: of the node; empty for that of the process.
        table: its parameter table.

    Attributes:
        table: its parameter table.
        parameters: the table with the present values.

    Raises:
        ParameterError: if a value is not accepted, or a parameter is not known.
    """

    def __init__(self, name: str, namespace: str, table: type[Any]) -> None:
        super().__init__(name, namespace=namespace)
        self.table = table
        for specification in specifications(self.table).values():
            self._declare(specification)
        self.parameters = self._build({})
        self._check_given()
        self.add_on_set_parameters_callback(self._validate)
        self.add_post_set_parameters_callback(self._apply)

    def check(self, parameters: Any) -> None:
        """Refuse changed parameters by a KhrError of one line; by default none is refused."""

    def on_changes(self, changes: dict[str, Any]) -> None:
        """Take the new values of parameters, by name; ``parameters`` has them already."""

    def _declare(self, specification: Specification) -> None:
        try:
            self.declare_parameter(
                specification.name, specification.default, describe(specification)
            )
        except ParameterException as error:
            given = self._parameter_overrides.get(specification.name)
            if given is not None:
                specification.check(given.value)  # raises with a better text
            raise ParameterError(str(error)) from error

    def _check_given(self) -> None:
        """Refuse undeclared parameters, which ROS drops silently."""
        known = frozenset({*specifications(self.table), *OF_ROS})
        blocks = [block for file in files_in(sys.argv) for block in read_blocks(file)]
        for warning in check_blocks(blocks, self.get_fully_qualified_name(), known):
            self.get_logger().warning(warning)
        for name in (
            set(self._parameter_overrides)
            - known
            - {key for block in blocks for key in block.parameters}
        ):
            check(self.table, name, None)  # raises, and lists the accepted names

    def _build(self, changes: dict[str, Any]) -> Any:
        """Return the table with some values changed; raise ParameterError if it refuses them."""
        values = {name: self._value(name) for name in specifications(self.table)}
        return build(self.table, values | changes)

    def _value(self, name: str) -> Any:
        try:
            return plain(self.get_parameter(name).value)
        except ParameterUninitializedException:  # a list without elements has no type in ROS
            return []

    def _validate(self, parameters: list[Parameter]) -> SetParametersResult:
        own = specifications(self.table)
        try:
            changes = {p.name: plain(p.value) for p in parameters if p.name in own}
            self.check(self._build(changes))
        except KhrError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[Parameter]) -> None:
        own = specifications(self.table)
        before = self.parameters
        self.parameters = self._build(
            {p.name: plain(p.value) for p in parameters if p.name in own}
        )
        changes = {
            name: plain(value)
            for name, value in vars(self.parameters).items()
            if value != getattr(before, name)
        }
        if changes:
            self.on_changes(changes)
