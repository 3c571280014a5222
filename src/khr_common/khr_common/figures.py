"""The figures that messages carry as texts by name: read in one place, and refused there."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

from khr_common.run_identity import MalformedError, is_integer

LONGEST = 40  # characters of a figure
# A node that takes changed parameters says so on `diagnostics`: under its name with this behind it,
# the new values as JSON, and the last instant, ns, that they come too late for.
CHANGED, AFTER = ': parameters', 'after_ns'


def figure(values: Mapping[str, str], name: str) -> float:
    """Return a figure.

    Raises:
        MalformedError: if it is missing or no finite number.
    """
    text = values.get(name, '')
    try:
        number = float(text) if isinstance(text, str) and len(text) <= LONGEST else float('nan')
    except ValueError:
        number = float('nan')
    if not isfinite(number):
        raise MalformedError(f'{name} is not a number')
    return number


def whole(values: Mapping[str, str], name: str) -> int:
    """Return a figure that counts something.

    Raises:
        MalformedError: if it is missing or no integer.
    """
    text = values.get(name, '')
    if not isinstance(text, str) or not is_integer(text):
        raise MalformedError(f'{name} is not an integer')
    return int(text)
