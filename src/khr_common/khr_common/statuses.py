"""The text in statuses and on ``ready``: the identity of the run, and numbers by name.

``khr run`` gives each run an identity, in the environment, so that no message of another run is
believed; nodes that are started by hand have none, and take part with one another.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from math import isfinite
from typing import Any

from khr_common.errors import MalformedError

VARIABLE = 'KHR_RUN'
KEY = 'run'  # of the identity in a status
_NONE = '-'
LONGEST = 40  # characters of a number
# A node reports changed parameters on `diagnostics`: its name with this suffix, the new values as
# JSON, and the stamp in ns of the last sample processed with the old values.
CHANGED, AFTER = ': parameters', 'after_ns'


def own_run() -> str:
    """Return the identity of the run that this process is started for; empty by hand."""
    return os.environ.get(VARIABLE, '')


def ready_text(name: str, stamp_ns: int, run: str) -> str:
    """Return a listener's text for ``ready``: it has received all samples up to a timestamp."""
    return f'{name} {stamp_ns} {run or _NONE}'


def read_ready(text: str, run: str) -> tuple[str, int]:
    """Return the listener and its stamp, ns.

    Raises:
        MalformedError: if the text has another form, or comes from another run.
    """
    words = text.split()
    if len(words) != 3 or not is_integer(words[1]):
        raise MalformedError('not NAME STAMP RUN')
    check_run(words[2].removeprefix(_NONE), run)
    return words[0], int(words[1])


def check_status(values: Mapping[str, str], run: str) -> None:
    """Check the figures of a status of the simulator.

    Raises:
        MalformedError: if it comes from another run, or its time is not an integer.
    """
    check_run(values.get(KEY, ''), run)
    integer(values, 'time_ns')


def check_run(found: str, run: str) -> None:
    """Check the run that a message comes from.

    Raises:
        MalformedError: if it is another one.
    """
    if found != run:
        raise MalformedError(f'of another run; {VARIABLE} of this node: {run or "not set"}')


def is_integer(text: str) -> bool:
    """Return whether a text is an integer of at most 64 bits."""
    return text.removeprefix('-').isdecimal() and len(text) < 20


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
