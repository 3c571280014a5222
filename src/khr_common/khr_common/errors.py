"""The errors that every package builds on."""

INTERRUPTED = 130  # exit code of a command that SIGINT ended, as shells have it


class KhrError(Exception):
    """What a user can mend; its text is one line: what, where, which value, what is accepted."""


class RunError(KhrError):
    """A computation that began and could not go on: a node died, a scheduler is gone."""
