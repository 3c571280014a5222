"""The controls of a scenario as text, and the title of a scenario that was changed."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_bringup.node_registry import controllers
from khr_common.errors import LONGEST

STATED = re.compile(r'(ankle|hip) gain|no control|without control|K_[AH] ')  # parts of a title
SET = re.compile(r'(\w+)\.(gain|enabled)=')  # changes that the text of the controls covers


def control_of(scenario: Any) -> str:
    """Return the controls of a Scenario that act, with their gains."""
    ankle, hip = scenario.table(AnkleControllerParameters), scenario.table(HipControllerParameters)
    words = [f'K_A {ankle.gain:g} ({ankle.source})'] if ankle.enabled else []
    words += [f'K_H {hip.gain:g}'] if hip.enabled else []
    others = scenario.answers[1:]
    words += [name for name in others if name not in ('ankle_controller', 'hip_controller')]
    return ', '.join(words) or 'without control'


def title_of(text: str) -> str:
    """Return the first line of a file's text if it is a comment, at most 200 characters."""
    first = text.lstrip().splitlines()[0] if text.strip() else ''
    return first.lstrip('# ').strip()[:LONGEST] if first.startswith('#') else ''


def bare_title(title: str) -> str:
    """Return a title without the parts that state the controllers."""
    return ', '.join(part for part in title.split(', ') if not STATED.match(part))


def last_of_each(texts: Iterable[str]) -> list[str]:
    """Return the last change of each parameter, as ``node.key=value``."""
    found: dict[str, str] = {}
    for text in texts:
        name = text.partition('=')[0]
        found.pop(name, None)
        found[name] = text
    return [*found.values()]


def title_with_changes(scenario: Any, texts: Iterable[str]) -> str:
    """Return the title of a Scenario after changes, each ``node.key=value``.

    Changed gains replace those of the title; other changes follow it, of each parameter the last.
    """
    title, rest = scenario.title or scenario.name, []
    changed = False
    for text in (' '.join(each.split()) for each in last_of_each(texts)):
        found = SET.match(text)
        if found and found[1] in controllers():
            changed = True
        else:
            rest.append(text)
    if changed:
        title = f'{bare_title(title)}, {control_of(scenario)}'
    return ', '.join([title, *rest])
