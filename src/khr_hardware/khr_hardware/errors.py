"""Errors of the communication with the board."""

from khr_common import RunError


class BoardError(RunError):
    """An exchange with the board failed; the message is one line."""


class NoReplyError(BoardError):
    """The board sent nothing, or not enough, before the timeout."""


class BadReplyError(BoardError):
    """The received frame is not the reply to the request."""


class RefusedError(BoardError):
    """The board answered NCK."""


class PortError(BoardError):
    """The port is closed or gone; it is never reopened."""
