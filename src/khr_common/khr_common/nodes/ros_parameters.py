"""Conversion between ROS parameters and plain values, and the descriptors of parameters."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python

from khr_common.parameters import Specification

LARGEST = 2**63 - 1  # of an integer parameter


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
