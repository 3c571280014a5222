"""Benches with invented measurements, so that the resulting scoreboard is known."""

from dataclasses import replace

from khr_analysis.outcome import Outcome
from khr_analysis.outcome_measures import Slides
from khr_studies.measuring.bench import Bench
from khr_studies.measuring.critical import START, Limit
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import LIMITS, STAGE_1
from khr_studies.measuring.thesis_walks import WALKS
from khr_sweeps.trial import outcome_columns


def full_outcome(verdict='walked', slip=0.0, vibration=0.1):
    """Return an outcome."""
    slides = Slides(0.001, slip, 0.002, 9)
    return Outcome(verdict, 13.5, None, 0.5, 0.0, 0.1, slip, slip, vibration, slides)


def outcome(verdict='walked', slip=0.0, vibration=0.1, **others):
    """Return the outcome columns of a run."""
    return {**outcome_columns(full_outcome(verdict, slip, vibration)), **others}


def walked(verdict='walked', *frequencies, slip=0.0, vibration=0.1, **measured):
    """Return the row of a walk that slides so far in each step."""
    others = (frequency for frequency in frequencies if frequency > 1.95)
    return {
        **outcome(verdict, slip, vibration),
        'slide_mm': 1e3 * slip,
        'before_mm': 1.0,
        'after_mm': 2.0,
        'peaks_hz': list(frequencies),
        'extra_peak_hz': next(others, None),
        'single': True,
        'slid_first': True,
        'dominated': False,
        'amplitude_rad_s': 0.2,
        'early': 0.5,
        'late': 0.95,
        **measured,
    }


def lifted(toe, heel, overshoot, load=0.0):
    """Return the row of a leg lift."""
    return {
        **outcome('stood'),
        'toe_n': toe,
        'heel_n': heel,
        'difference_n': toe - heel,
        'share': (toe - heel) / (toe + heel),
        'overshoot_rad_s': overshoot,
        'lifted_load': load,
    }


def walks(*rows):
    return run_table(rows)


def limits_of_thesis():
    found = {}
    for row in LIMITS:
        run = outcome(inclination_deg=row.thesis_deg, seed=0)
        found[row.condition] = Limit((row.thesis_deg,) * 2, runs=run_table([run]))
    return found


class Thesis(Bench):
    """A bench that reproduces the thesis, except for the condition in ``amiss``."""

    def __init__(self, amiss=None):
        super().__init__(None, seeds=2, tolerance=0.1)
        self.amiss = amiss
        self.asked = []

    def submit(self, function, *arguments):
        self.asked.append((function, *arguments))

    def limit(self, condition, seeds=None):
        here = replace(condition, changes=())  # the same on the other engine
        found = limits_of_thesis().get(here, Limit((START, START)))
        return replace(found, of_seeds=(2.0, 2.0)) if here == self.amiss else found

    def walks(self, condition, phi):
        rows = [row for row in WALKS if (row.condition, row.inclination_deg) == (condition, phi)]
        if any(row.survives is False for row in rows):
            return walks(*[walked('fell')] * self.seeds)
        gain = condition.ankle_gain + condition.hip_gain
        shown = [each for row in rows for each in (row.lines[:1] if row.either else row.lines)]
        lines = [sum(one) / 2.0 for one in dict.fromkeys(shown)]
        rubber = condition.surface == 'rubber'
        slide = 0.002 if rubber else 0.001 + phi**7 / 6e8 * (1.0 - gain / 100.0) ** 5
        walk = walked(
            'slipped',
            *lines,
            2.0 + gain / 50.0,
            slip=slide,
            vibration=0.001 * (1.0 + gain) ** 1.5 / (3.0 if rubber else 1.0),
            dominated=gain == 24.0,
            amplitude_rad_s=0.1 + phi,
        )
        return walks(*[walk] * self.seeds)

    def lifts(self, condition, phi):
        share = phi / 6.4 if condition == STAGE_1 else phi / 12.0
        share = share - 0.002 * phi**2 + 0.01
        overshoot = 0.1 + phi + 10.0 * max(phi - 7.6, 0.0)
        return run_table([lifted(7.0 * (1.0 + share), 7.0 * (1.0 - share), overshoot)] * 2)

    def pushes(self, job, conditions):
        return [5.0 + each.gain for each in conditions]


class Opposite(Thesis):
    """A bench on which nothing agrees with the thesis."""

    def limit(self, condition, seeds=None):
        return Limit((2.0, 2.0))

    def walks(self, condition, phi):
        falls = (super().walks(condition, phi)['verdict'] != 'fell').all()
        gain = condition.ankle_gain + condition.hip_gain
        walk = walked(
            'fell' if falls and phi != 6.99 else 'walked',
            20.0 - gain,
            slip=0.02 + gain / 1e4 - phi / 1e3,
            vibration=1.0 - gain / 100.0,
            single=False,
            slid_first=False,
            amplitude_rad_s=1.0 - phi / 100.0,
            late=0.4,
        )
        return walks(walk, walk)

    def lifts(self, condition, phi):
        return run_table([lifted(5.0 - phi**2 / 10.0, 9.0 + phi**2 / 10.0, 0.1, load=0.3)] * 2)

    def pushes(self, job, conditions):
        return [5.0 - each.gain / 10.0 for each in conditions]
