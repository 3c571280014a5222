"""What a running scenario is called."""

from __future__ import annotations

from pathlib import Path

from khr_bringup.scenario import shipped, title_of
from khr_bringup.strict_yaml import read_file


def scenario_name(file: Path) -> str:
    """Return the name of the shipped scenario that a file as run began from, or else its title.

    A run keeps a scenario under a name of its own (``scenario.yaml``), with its title.

    Raises:
        BringupError: if the file does not read.
    """
    title = title_of(read_file(file))
    named = (path.stem for path in shipped() if title_of(read_file(path)) == title)
    return next(named, title)
