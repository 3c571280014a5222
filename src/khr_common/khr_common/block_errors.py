"""Errors in the code of a block, with the place in its file."""

from __future__ import annotations

import inspect
import sys
import traceback
from typing import Any


def error_text(kind: type[Any], error: Exception) -> str:
    """Return an exception of a block as one line with the type, the text, file and line."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename == inspect.getfile(kind)]
    place = (own or frames)[-1]
    text = ' '.join(str(error).split())
    return f'{type(error).__name__}: {text} ({place.filename}, line {place.lineno})'


def print_traceback(kind: type[Any], error: Exception) -> None:
    """Print the traceback of an exception on stderr, from the file of the block on."""
    frames = error.__traceback__
    while frames and frames.tb_frame.f_code.co_filename != inspect.getfile(kind):
        frames = frames.tb_next
    traceback.print_exception(type(error), error, frames or error.__traceback__, file=sys.stderr)
