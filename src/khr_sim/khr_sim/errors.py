"""The errors of the simulator."""

from khr_common import KhrError


class SimError(KhrError):
    """A mistake in what the simulator is given; its text is one line that says how to mend it."""
