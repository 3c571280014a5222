"""The base of every error that a khr package raises for a reason a user can act on."""


class KhrError(Exception):
    """A mistake that the user can mend; its text is one line that says how."""
