"""Write the numbers of the models' document: its name is the command line's one argument."""

from __future__ import annotations

from functools import cache

from khr_analysis.models.standing_numbers import (
    ankle_numbers,
    friction_numbers,
    pendulum_numbers,
    push_numbers,
)
from khr_analysis.models.walking_numbers import (
    harmonics_numbers,
    identification_numbers,
    servo_loop_numbers,
    stiffness_numbers,
)
from khr_common.markdown import put_between, rewrite_document

BEGIN = '<!-- begin: written by python -m khr_analysis.models.report docs/models.md -->'
END = '<!-- end -->'


@cache
def tables() -> str:
    """Return the numbers of the document as Markdown."""
    parts = [
        '### The pendulum (3.1)-(3.10)',
        pendulum_numbers(),
        '### The ankle servo and the force loop (3.11)-(3.13)',
        ankle_numbers(),
        '### Friction',
        friction_numbers(),
        '### The servo loop (5.1)-(5.14)',
        servo_loop_numbers(),
        '### Identification',
        identification_numbers(),
        '### Joint stiffness',
        stiffness_numbers(),
        '### Harmonics (5.15)-(5.20)',
        harmonics_numbers(),
        '### Push recovery (4.1)-(4.7)',
        push_numbers(),
    ]
    return '\n\n'.join(parts)


def rewrite(text: str) -> str:
    """Replace what stands between the markers.

    Raises:
        KhrError: if a marker is missing.
    """
    return put_between(text, BEGIN, END, tables())


def main() -> None:
    """Rewrite the document named on the command line."""
    rewrite_document(rewrite)


if __name__ == '__main__':
    main()
