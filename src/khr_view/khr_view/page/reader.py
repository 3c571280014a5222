"""Callbacks of controls: changes by the user of the page, not by the program."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

Later = Callable[..., None]  # has a function called with the values that follow it


def on_user_input(act: Callable[[Any], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """Wrap a control's callback so that only values set by a user reach it.

    The callback is a coroutine, which viser awaits at once. viser calls a plain function later in
    another thread, when the program may have overwritten the user's value.
    """

    async def on_update(event: Any) -> None:
        if event.client is not None:
            act(event.target.value)

    return on_update


def give_value(server: Any, control: Any, value: Any) -> None:
    """Set the value of a control, but not between a user's change and its callback."""
    server.get_event_loop().call_soon_threadsafe(setattr, control, 'value', value)
