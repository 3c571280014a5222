"""Running measures of the outcome: slip of the soles, vibration of the torso."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, pi, sin, sqrt, tan
from typing import NamedTuple

from khr_common.rotation import Vector, dot

Pair = tuple[Vector, Vector]  # of the left and the right foot
STILL: Vector = (0.0, 0.0, 0.0)
ORDER = 16  # of the high-pass of the vibration
SWING = 0.25  # s without load from which on a foot has lifted off; it swings 0.45 s, and taps up to 0.15


class SoleSlip:
    """Distance that one sole slid while it was loaded.

    Only motion across the sole's normal counts: a foot that tips over its edge moves its middle
    along the normal, which is no slip. The net displacement per ground contact is taken, so that
    trembling on the spot does not add up.

    Attributes:
        largest: largest displacement so far in one ground contact, by the share of the load, m. On
            both feet it is half of the way of a sole; a foot that bounces begins another contact.
    """

    def __init__(self) -> None:
        self._place: Sequence[float] | None = None  # at the last sample, if loaded then
        self._normal: Vector = (0.0, 0.0, 1.0)
        self._slide = STILL  # since the sole was loaded
        self._past = 0.0  # of earlier times on the ground
        self.largest = 0.0

    @property
    def slip(self) -> float:
        """Return the sum of the net displacements in all ground contacts, m."""
        return self._past + hypot(*self._slide)

    def follow(self, place: Sequence[float], normal: Vector, share: float) -> Vector:
        """Take the pose at a sample, and the share of the load since the last one.

        Args:
            place: of the sole, m.
            normal: of the sole.
            share: of the robot's load; 0 is a foot in the air.

        Returns:
            The slip since the last sample, m.
        """
        way = STILL
        if share and self._place is not None:
            step = _across(self._place, place, self._normal, normal)
            way = (share * step[0], share * step[1], share * step[2])
            self._slide = _sum(self._slide, way)
            self.largest = max(self.largest, hypot(*self._slide))
        elif not share:
            self._past, self._slide = self.slip, STILL
        self._place, self._normal = (place if share else None), normal
        return way


class Slides(NamedTuple):
    """Slides in a walk, and in the stance before and after it, m.

    Each sole counts by its share of the load; in the stance both count together, so that a robot
    that slides on both feet has slid as far as they did.
    """

    # until the first foot lifts off; of a run without a step all of it
    before: float = 0.0
    # mean over the steps, each the net slip of one foot in one ground contact, from the first
    # lift-off to the last touchdown
    per_step: float = 0.0
    after: float = 0.0  # since the last foot touched down
    steps: int = 0  # number of steps

    @property
    def last(self) -> float:
        """Return the slide in the stance that the run ended in, m."""
        return self.after if self.steps else self.before


class StepSlides:
    """Separate the slides of a walk from those of the stance before and after it.

    A foot has lifted off when it was unloaded for SWING; a bounce does not count. The slides
    before it are taken at the first unloaded sample.

    Args:
        period: of the samples, s.
    """

    def __init__(self, period: float) -> None:
        self._swing = max(round(SWING / period), 1)
        self._unloaded = [0, 0]  # samples without load
        self._slides = (STILL, STILL)  # since the start, or since the foot touched down
        self._at_unloading = [self._slides, self._slides]
        self._at_touchdown = self._slides  # of the foot that came down last
        self._standing: int | None = None  # the other foot, if it has not lifted off since
        self._before: float | None = None
        self._sum, self._count = 0.0, 0

    def follow(self, ways: Pair, loaded: Sequence[bool]) -> None:
        """Take the slide of each sole since the last sample, m, and whether it is loaded."""
        until, self._slides = self._slides, _plus(self._slides, ways)
        for foot, is_loaded in enumerate(loaded):
            if is_loaded:
                if self._unloaded[foot] >= self._swing:
                    self._touch_down(foot)
                self._unloaded[foot] = 0
                continue
            if not self._unloaded[foot]:
                self._at_unloading[foot] = until
            self._unloaded[foot] += 1
            if self._unloaded[foot] == self._swing:
                self._lift_off(foot)

    @property
    def _together(self) -> float:
        """Return the slide of both soles since the last touchdown, or since the start."""
        return _length(_less(self._slides, self._at_touchdown))

    @property
    def slides(self) -> Slides:
        """Return the slides, as if this were the last sample."""
        if self._before is None:
            return Slides(before=self._together)
        total, count = self._sum, self._count
        if self._standing is not None:
            total, count = total + hypot(*self._at_touchdown[self._standing]), count + 1
        return Slides(self._before, total / count if count else 0.0, self._together, count)

    def _lift_off(self, foot: int) -> None:
        then = self._at_unloading[foot]
        if self._before is None:
            self._before = _length(then)
            self._slides = _less(self._slides, then)
            self._at_unloading = [_less(slides, then) for slides in self._at_unloading]
        else:
            self._sum += hypot(*then[foot])
            self._count += 1
        if self._standing == foot:
            self._standing = None

    def _touch_down(self, foot: int) -> None:
        self._slides = (STILL, self._slides[1]) if foot == 0 else (self._slides[0], STILL)
        self._at_touchdown, self._standing = self._slides, 1 - foot


class Vibration:
    """Root mean square of a rate behind a high-pass: a Butterworth of order 16.

    With a corner of 4 Hz it separates the rocking of the gait from the loops: it passes 10 % of the
    amplitude at 3.46 Hz, twice f_0, and 96 % at 4.33 Hz, the next line but one of the gait cycle.

    Args:
        corner: half of the power passes there, Hz.
        period: of the samples, s.
        end: time up to which samples count, s: a robot at rest does not vibrate, and would lower
            the mean the longer it stands.
    """

    def __init__(self, corner: float, period: float, end: float = inf) -> None:
        warped = tan(pi * corner * period)
        angles = (pi * (section + 0.5) / ORDER for section in range(ORDER // 2))
        self._sections = [_HighPass(warped, 2.0 * sin(angle)) for angle in angles]
        self._sum, self._count = 0.0, 0
        self._end = end + 0.5 * period

    @property
    def rms(self) -> float:
        """Return the root mean square of the samples so far, in the unit of the rate; 0 of none."""
        return sqrt(self._sum / max(self._count, 1))

    def add(self, time: float, rate: float) -> None:
        """Take a sample and its time in s."""
        if time > self._end:
            return
        high = float(rate)
        for section in self._sections:
            high = section.filter(high)
        self._sum += high * high
        self._count += 1


class _HighPass:
    """One section of a Butterworth high-pass, by the bilinear transform.

    In closed form and sample by sample: to import SciPy's filters takes a second, and they are made
    for whole arrays.

    Args:
        warped: tan(pi corner period).
        damping: twice the damping ratio of the section's poles.
    """

    def __init__(self, warped: float, damping: float) -> None:
        self._scale = 1.0 / (1.0 + damping * warped + warped * warped)
        self._a1 = 2.0 * (warped * warped - 1.0) * self._scale
        self._a2 = (1.0 - damping * warped + warped * warped) * self._scale
        self._first = self._second = 0.0

    def filter(self, value: float) -> float:
        """Return the filtered value of a sample; transposed direct form II."""
        passed = self._scale * value
        high = passed + self._first
        self._first = self._second - 2.0 * passed - self._a1 * high
        self._second = passed - self._a2 * high
        return high


def _sum(first: Vector, second: Vector) -> Vector:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def _plus(first: Pair, second: Pair) -> Pair:
    return _sum(first[0], second[0]), _sum(first[1], second[1])


def _less(first: Pair, second: Pair) -> Pair:
    (ax, ay, az), (bx, by, bz) = second
    return _plus(first, ((-ax, -ay, -az), (-bx, -by, -bz)))


def _length(slides: Pair) -> float:
    """Return the distance that both soles slid together."""
    return hypot(*_sum(*slides))


def _across(
    before: Sequence[float], now: Sequence[float], normal_before: Vector, normal: Vector
) -> Vector:
    """Return the part of a step that is normal to the mean of two normals."""
    mean = _sum(normal_before, normal)
    step = now[0] - before[0], now[1] - before[1], now[2] - before[2]
    along = dot(step, mean) / dot(mean, mean)
    return step[0] - along * mean[0], step[1] - along * mean[1], step[2] - along * mean[2]
