"""Signals as in a terminal, wherever tests and the campaign were started."""

import signal


def hand_on_signals() -> None:
    """Let commands that are started take the signals that are tried, also if this one ignores them.

    A shell has what it starts in the background ignore SIGINT, nohup SIGHUP, and who is started
    inherits that; what is handled here is as in a terminal there.
    """
    for number, handler in (
        (signal.SIGINT, signal.default_int_handler),
        (signal.SIGHUP, lambda *_: None),
    ):
        if signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, handler)
