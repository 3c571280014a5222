"""Numbers by name, as text in the key-value pairs of a ``diagnostic_msgs/DiagnosticStatus``."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

from khr_common.errors import MalformedError
from khr_common.run_identity import is_integer

LONGEST = 40  # characters of a number
# A node reports changed parameters on `diagnostics`: its name with this suffix, the new values as
# JSON, and the stamp in ns of the last sample processed with the old values.
CHANGED, AFTER = ': parameters', 'after_ns'


def real(values: Mapping[str, Any], name: str) -> float:
    """Return a finite number, which may be written as text.

    Raises:
        MalformedError: if it is missing or not a finite number.
    """
    text = str(values.get(name, ''))
    try:
        number = float(text) if len(text) <= LONGEST else float('nan')
    except ValueError:
        number = float('nan')
    if not isfinite(number):
        raise MalformedError(f'{name} is not a number')
    return number


def integer(values: Mapping[str, Any], name: str) -> int:
    """Return an integer, which may be written as text.

    Raises:
        MalformedError: if it is missing or not an integer.
    """
    text = str(values.get(name, ''))
    if not is_integer(text):
        raise MalformedError(f'{name} is not an integer')
    return int(text)
