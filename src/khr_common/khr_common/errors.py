"""The errors that every package builds on, and foreign values in their texts.

An error text is one line, and never longer than a line may be.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Self

INTERRUPTED = 130  # exit code of a command that SIGINT ended, as shells have it
LONGEST = 200  # characters of a foreign value that an error text repeats


class KhrError(Exception):
    """A user's mistake; its text is one line with name, place, value and accepted values.

    Args:
        text: the line; characters of foreign names that do not fit into a line are replaced.
            Gymnasium passes the error of a worker process instead.
    """

    def __init__(self, text: object = '') -> None:
        line = str(text)
        super().__init__(line if line.isprintable() else _printable(line))

    @classmethod
    def refused(cls, name: str, value: object, accepted: str) -> Self:
        """Return an error that names a value and the accepted values."""
        return cls(f'{name}: {quoted(value)} is not accepted; accepted: {accepted}')


class RunError(KhrError):
    """A computation failed after its start: a node died, a scheduler disappeared."""


class MalformedError(KhrError):
    """A message that is not accepted, with the reason."""


def quoted(value: object) -> str:
    """Return the repr of a value as one line, at most 200 characters of it."""
    try:
        text = repr(value)
    except Exception:  # an integer of thousands of digits, or a class of the caller
        text = f'<{type(value).__name__}>'
    if not text.isprintable():  # as of an array of several rows
        text = _printable(text[: 4 * LONGEST])
    return text if len(text) <= LONGEST else f'{text[: LONGEST - 3]}...'


def named(key: object) -> str:
    """Return a key as it stands, or quoted if it would not fit into a line of text."""
    return (
        key if isinstance(key, str) and key.isprintable() and len(key) < LONGEST else quoted(key)
    )


def meant(name: object, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return ``did you mean NAME?`` and a blank for the known name most like this one, if any."""
    near = get_close_matches(str(name), known, 1, cutoff)
    return f'did you mean {near[0]}? ' if near else ''


def one_line(text: str) -> str:
    """Return a foreign text as one printable line, at most 200 characters of it."""
    plain = _printable(text[: 4 * LONGEST])
    return plain if len(plain) <= LONGEST else f'{plain[: LONGEST - 3]}...'


def _printable(text: str) -> str:
    """Return a text in one line; other characters that cannot be printed become ``?``."""
    line = ' '.join(text.split())
    return ''.join(each if each.isprintable() else '?' for each in line)
