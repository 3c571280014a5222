"""The changelog of a package (REP 132), from the one of the project."""

from __future__ import annotations

import re
from textwrap import wrap

WIDTH = 96


def changelog_rst(package: str, changelog: str) -> str:
    """Return ``CHANGELOG.rst`` of a package: what has been released, all packages together.

    Args:
        package: its name.
        changelog: the project's ``CHANGELOG.md``, in the form of Keep a Changelog.
    """
    title = f'Changelog for package {package}'
    bar = '^' * len(title)
    parts = [
        f'{bar}\n{title}\n{bar}\n',
        'Written by ``make docs`` from the CHANGELOG.md of khr.\n',
    ]
    for version, date, body in _releases(changelog):
        heading = f'{version} ({date})'
        parts += [f'{heading}\n{"-" * len(heading)}\n' + '\n'.join(_items(body)) + '\n']
    return '\n'.join(parts)


def _releases(changelog: str) -> list[tuple[str, str, str]]:
    """Return version, date and text of each release."""
    parts = re.split(r'^## \[(\d+\.\d+\.\d+)\] - (\S+)\n', changelog, flags=re.MULTILINE)[1:]
    return list(zip(parts[::3], parts[1::3], parts[2::3], strict=True))


def _items(body: str) -> list[str]:
    """Return the items of a release, each led by what kind of change it is."""
    lines, kind = [], ''
    for paragraph in re.split(r'\n(?=[-#])|\n\n', body):
        text = ' '.join(paragraph.split())
        if text.startswith('### '):
            kind = text.removeprefix('### ')
        elif text.startswith('- '):
            words = re.sub(r'`([^`]+)`', r'``\1``', f'{kind}: {text[2:]}')
            lines += wrap(words, WIDTH, initial_indent='* ', subsequent_indent='  ')
    return lines
