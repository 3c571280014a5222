"""What a running scenario is called."""

from __future__ import annotations

from khr_bringup.scenario.scenario import shipped, title_of
from khr_common.text.quoting import one_line
from khr_common.text.strict_yaml import read_file


def scenario_name(text: str) -> str:
    """Return the name of the shipped scenario that one as run began from, or else its title.

    A run keeps a scenario under a name of its own (``scenario.yaml``), with its title.
    """
    title = title_of(text)
    named = (path.stem for path in shipped() if title_of(read_file(path)) == title)
    return one_line(next(named, title))
