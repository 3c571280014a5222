"""A push: a force on a link for a given time, reproducible to the physics step."""

from __future__ import annotations

import math
from dataclasses import dataclass

from khr_common.errors import KhrError

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Push:
    """A constant force on a point of a link.

    Args:
        start: s of simulated time.
        duration: s.
        link: link that the force acts on.
        frame: frame of the force: ``odom`` or the name of the link.
        force: N, (3,).
        point: point of action in the frame of the link, m, (3,).

    Raises:
        KhrError: naming the field, its value and what is accepted.
    """

    start: float
    duration: float
    link: str
    frame: str
    force: Vector
    point: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and self.start >= 0.0):
            raise KhrError.refused('t', self.start, 'seconds, 0 or more')
        if not (math.isfinite(self.duration) and self.duration > 0.0):
            raise KhrError.refused('duration', self.duration, 'seconds, more than 0')
        if self.frame not in ('odom', self.link):
            raise KhrError.refused('frame', self.frame, f'odom | {self.link}')
        for name in ('force', 'point'):
            vector = getattr(self, name)
            if len(vector) != 3 or not all(map(math.isfinite, vector)):
                raise KhrError.refused(name, vector, 'three finite numbers')

    @classmethod
    def parse(cls, text: str) -> Push:
        """Parse a push from words ``key=value``, as in a scenario.

        The keys are t, duration, link, frame, force and the optional point:
        ``t=5.0 duration=0.1 link=base_link frame=odom force=8,0,0 point=0,0,0.05``

        Raises:
            KhrError: if a word is unknown, given twice, missing or not accepted.
        """
        values: dict[str, str] = {}
        for word in text.split():
            key, _, value = word.partition('=')
            if key not in _KEYS or key in values or not value:
                raise KhrError.refused(
                    'push', text, f'each of {" ".join(f"{k}=..." for k in _KEYS)} once'
                )
            values[key] = value
        values.setdefault('point', '0,0,0')
        if missing := [key for key in _KEYS if key not in values]:
            raise KhrError.refused(
                'push', text, f'also {" ".join(f"{key}=..." for key in missing)}'
            )
        return cls(
            _number('t', values['t']),
            _number('duration', values['duration']),
            values['link'],
            values['frame'],
            _triple('force', values['force']),
            _triple('point', values['point']),
        )


_KEYS = ('t', 'duration', 'link', 'frame', 'force', 'point')


def _number(key: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise KhrError.refused(key, text, 'a number') from error


def _triple(key: str, text: str) -> Vector:
    numbers = [_number(key, part) for part in text.split(',')]
    if len(numbers) != 3:
        raise KhrError.refused(key, text, 'three numbers, x,y,z')
    return tuple(numbers)
