"""What every khr package shares: the parameter table, the error base and the node shell."""

from khr_common.errors import KhrError
from khr_common.parameters import ParameterError, build, check, parameter, specifications

__all__ = ['KhrError', 'ParameterError', 'build', 'check', 'parameter', 'specifications']
