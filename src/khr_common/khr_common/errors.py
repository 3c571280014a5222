"""The errors that every package builds on."""

INTERRUPTED = 130  # exit code of a command that SIGINT ended, as shells have it


class KhrError(Exception):
    """A user's mistake; its text is one line with name, place, value and accepted values."""


class RunError(KhrError):
    """A computation failed after its start: a node died, a scheduler disappeared."""
