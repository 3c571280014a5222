"""The help of verbs and groups: a flag has no type, because it takes no value."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperGroup


class _Plain:
    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options, flags without a type."""
        found: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for each in found:
            if getattr(each, 'is_flag', False):
                each.metavar = ''
        return found


class Command(_Plain, TyperCommand):
    """A verb."""


class Group(_Plain, TyperGroup):
    """Verbs."""
