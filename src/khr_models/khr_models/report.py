"""Write the numbers of the models' document: its name is the command line's one argument."""

from __future__ import annotations

from functools import cache

from khr_common.markdown import WrittenPart
from khr_models.numbers.standing import (
    ankle_numbers,
    friction_numbers,
    pendulum_numbers,
    push_numbers,
)
from khr_models.numbers.walking import (
    gain_unit_numbers,
    harmonics_numbers,
    identification_numbers,
    servo_loop_numbers,
    stiffness_numbers,
)

PARTS = {
    'The pendulum (3.1)-(3.10)': pendulum_numbers,
    'The ankle servo and the force loop (3.11)-(3.13)': ankle_numbers,
    'Friction': friction_numbers,
    'The servo loop (5.1)-(5.14)': servo_loop_numbers,
    'Identification': identification_numbers,
    'Gain unit of both gyro loops': gain_unit_numbers,
    'Joint stiffness': stiffness_numbers,
    'Harmonics (5.15)-(5.20)': harmonics_numbers,
    'Push recovery (4.1)-(4.7)': push_numbers,
}


@cache
def tables() -> str:
    """Return the numbers of the document as Markdown."""
    return '\n\n'.join(f'### {title}\n\n{numbers()}' for title, numbers in PARTS.items())


PART = WrittenPart('khr_models.report docs/models.md', tables)

if __name__ == '__main__':
    PART.main()
