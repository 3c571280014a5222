"""Benches whose measurements are invented: what the scoreboard makes of them is known."""

from dataclasses import replace

from khr_analysis.outcome import Outcome
from khr_analysis.outcome_measures import Slides
from khr_analysis.peaks import Peak
from khr_studies.measuring.bench import Bench, MeasuredLift, MeasuredWalk
from khr_studies.measuring.critical import START
from khr_studies.measuring.limit import Attempt, Limit
from khr_studies.measuring.thesis_values import LIMITS, STAGE_1, WALKS


def outcome(verdict='walked', slip=0.0, vibration=0.1):
    slides = Slides(0.001, slip, 0.002, 9)
    return Outcome(verdict, 13.5, None, 0.5, 0.0, 0.1, slip, slip, vibration, slides)


def walked(verdict='walked', *frequencies, **figures):
    return MeasuredWalk(
        outcome(verdict, **figures), tuple(Peak(f, 0.1, 0.0, 'other') for f in frequencies)
    )


def limits_of_thesis():
    return {
        row.condition: Limit(
            (row.thesis_deg, row.thesis_deg), (Attempt(row.thesis_deg, 0, outcome()),)
        )
        for row in LIMITS
    }


class Thesis(Bench):
    """A bench that reproduces the thesis, except for the condition in ``amiss``."""

    def __init__(self, amiss=None):
        super().__init__(None, seeds=2, tolerance=0.1)
        self.amiss = amiss
        self.asked = []

    def submit(self, function, *arguments):
        self.asked.append((function, *arguments))

    def limit(self, condition, seeds=None):
        here = replace(condition, changes=())  # the other engine says the same
        found = limits_of_thesis().get(here, Limit((START, START), ()))
        return Limit((2.0, 2.0), found.attempts) if here == self.amiss else found

    def walks(self, condition, phi):
        row = next(
            (row for row in WALKS if (row.condition, row.inclination_deg) == (condition, phi)),
            None,
        )
        if row is not None and row.survives is False:
            return [walked('fell')] * self.seeds
        gain = condition.ankle_gain + condition.hip_gain
        lines = [sum(one) / 2.0 for one in row.lines] if row else []
        slide = 0.002 if condition.surface == 'rubber' else phi**7 / 6e8 * (1.0 - gain / 100.0)
        return [
            walked('slipped', *lines, 2.0 + gain / 10.0, slip=slide, vibration=gain / 100.0)
        ] * self.seeds

    def lifts(self, condition, phi):
        share = phi / 6.4 if condition == STAGE_1 else phi / 12.0
        return [
            MeasuredLift(outcome('stood'), 7.0 * (1.0 + share), 7.0 * (1.0 - share), 0.1 + phi)
        ] * 2


class Opposite(Thesis):
    """A bench on which nothing agrees with the thesis."""

    def limit(self, condition, seeds=None):
        return Limit((2.0, 2.0), ())

    def walks(self, condition, phi):
        falls = all(one.outcome.verdict != 'fell' for one in super().walks(condition, phi))
        gain = condition.ankle_gain + condition.hip_gain
        return [
            walked(
                'fell' if falls and phi != 6.99 else 'walked',
                20.0 - gain,
                slip=0.02 + gain / 1e4 - phi / 1e3,
                vibration=1.0 - gain / 100.0,
            )
        ] * 2

    def lifts(self, condition, phi):
        return [MeasuredLift(outcome('stood'), 7.0 - phi / 10.0, 7.0 + phi / 10.0, 0.1)] * 2
