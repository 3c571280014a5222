"""Callbacks of controls: actions of the reader, apart from changes made by the program."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

Later = Callable[..., None]  # has a function called with the values that follow it


def by_reader(act: Callable[[Any], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """Call with a control's new value when a reader has changed it, not when we have.

    viser awaits a coroutine at once. A function it calls in another thread, some time later, when
    a value that we show may have taken the reader's place.
    """

    async def on_update(event: Any) -> None:
        if event.client is not None:
            act(event.target.value)

    return on_update


def give_value(server: Any, control: Any, value: Any) -> None:
    """Give a control a value, but not between a reader's change and its callback."""
    server.get_event_loop().call_soon_threadsafe(setattr, control, 'value', value)
