"""What every khr package shares: parameter tables, interfaces, errors, the base of the nodes."""

from khr_common.errors import KhrError, RunError
from khr_common.parameters import (
    ParameterError,
    build,
    check,
    parameter,
    sample_period,
    specifications,
)

__all__ = [
    'KhrError',
    'ParameterError',
    'RunError',
    'build',
    'check',
    'parameter',
    'sample_period',
    'specifications',
]
