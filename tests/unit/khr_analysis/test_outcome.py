"""The outcome of synthetic runs whose verdict and figures are known in closed form."""

from dataclasses import dataclass, replace
from math import cos, pi, radians, sin, tau

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt
from scipy.spatial.transform import Rotation

from khr_analysis.outcome import SENSED, MonitorParameters, OutcomeMonitor, SensedMonitor
from khr_analysis.outcome_measures import Slides
from khr_analysis.outcome_values import labelled
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.interfaces import FOOT_FORCES, GYRO, TRUE_FORCES, TRUE_POSE, TRUE_RATE, TRUE_SOLES
from khr_common.published import GAIT_FREQUENCY

PERIOD_NS = 15_000_000
HEIGHT = 0.25


@dataclass
class Seen:
    """A robot that stands, on a slope of phi; distances are along the surface."""

    phi: float = 0.0
    forward: float = 0.0
    left: float = 0.0
    height: float = HEIGHT
    lean: float = 0.0  # of the torso from the vertical, about +y
    roll: float = 0.0
    heading: float = 0.0
    rate: float = 0.0
    feet: tuple = ((0.0, 0.04, 0.0), (0.0, -0.04, 0.0))  # forward, left, up from the surface
    foot_pitch: tuple = (0.0, 0.0)  # against the surface
    load: tuple = (7.0, 7.0)

    def _place(self, forward, left, up):
        return Rotation.from_euler('y', self.phi).apply((forward, left, up))

    @property
    def signals(self):
        """What the topics of the truth carry of it."""
        x, y, z = self._place(self.forward, self.left, 0.0).tolist()
        turn = Rotation.from_euler('ZYX', (self.heading, self.lean, self.roll)).as_quat()
        soles = [
            number
            for foot, pitch in zip(self.feet, self.foot_pitch, strict=True)
            for part in (self._place(*foot), Rotation.from_euler('y', self.phi + pitch).as_quat())
            for number in part.tolist()
        ]
        forces = [(3.0, 3.0, load / 2) for load in self.load for _ in range(2)]
        return {
            TRUE_POSE: [x, y, z + self.height, *turn.tolist()],
            TRUE_RATE: [9.0, self.rate, 9.0],
            TRUE_SOLES: soles,
            **dict(zip(TRUE_FORCES, forces, strict=True)),
        }


def judged(run, parameters=None):
    monitor = OutcomeMonitor(parameters or MonitorParameters())
    return [monitor.update(k * PERIOD_NS, seen.signals) for k, seen in enumerate(run)]


def walk(steps=8, length=0.05, phi=0.0, slide=0.0):
    """Yield a walk: one foot is lifted and carried on while the other, loaded, may slide."""
    feet = [np.array([0.0, 0.04, 0.0]), np.array([0.0, -0.04, 0.0])]
    for number in range(steps):
        swing, stance = number % 2, 1 - number % 2
        for part in np.linspace(0.0, 1.0, 21):
            now = [foot.copy() for foot in feet]
            now[swing] += (length * part, 0.0, 0.02 * sin(pi * part))
            now[stance][0] += slide * part
            load = (
                (14.0, 14.0)
                if part in (0.0, 1.0)
                else tuple(0.0 if side == swing else 14.0 for side in range(2))
            )
            yield Seen(
                phi=phi,
                forward=float(np.mean([foot[0] for foot in now])),
                load=load,
                feet=tuple(map(tuple, now)),
            )
        feet = now


@pytest.mark.parametrize('phi_deg', [-5.0, 0.0, 9.7])
def test_walking_counts_the_way_along_the_surface_and_no_slip(phi_deg):
    outcome = judged(walk(phi=radians(phi_deg)))[-1]
    assert (outcome.verdict, outcome.fell_at) == ('walked', None)
    assert outcome.time == pytest.approx((8 * 21 - 1) * 0.015)
    assert outcome.distance == pytest.approx(8 * 0.05 / 2, abs=1e-9)
    assert outcome.lateral_drift == pytest.approx(0.0, abs=1e-12)
    assert outcome.slip_distance == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(('slide', 'verdict'), [(0.013, 'walked'), (0.016, 'slipped')])
def test_sliding_of_the_stance_foot_adds_up_over_the_steps(slide, verdict):
    outcome = judged(walk(phi=radians(8.88), slide=slide))[-1]
    # Of the 20 parts of a slide, the last counts half: the other foot has taken half the load.
    assert outcome.slip_distance == pytest.approx(8 * slide * 19.5 / 20, abs=1e-9)
    assert outcome.largest_slip == pytest.approx(slide * 19.5 / 20, abs=1e-9)
    assert outcome.verdict == verdict


def stance(seen, slide, count=20):
    """Yield both soles sliding, each under half the load."""
    for part in np.linspace(0.0, slide, count):
        feet = tuple((x + float(part), y, z) for x, y, z in seen.feet)
        yield replace(seen, feet=feet, load=(7.0, 7.0))


def test_a_sole_that_slides_back_ends_with_less_net_slip_than_its_largest():
    seen = next(iter(walk()))
    outcome = judged([*stance(seen, 0.03), *list(stance(seen, 0.03))[::-1]])[-1]
    assert outcome.slip_distance == pytest.approx(0.0, abs=1e-9)
    assert outcome.largest_slip > 0.01
    assert float(labelled(outcome)['net slip of both soles, m']) == 0.0


def test_slides_of_the_steps_are_told_from_those_of_the_stance_before_and_after():
    walked = list(walk(slide=0.008))
    start = list(stance(walked[0], -0.03))[::-1]
    outcome = judged([*start, *walked, *stance(walked[-1], 0.01)])[-1]
    assert outcome.slides.before == pytest.approx(0.03), 'of both soles, each by half the load'
    assert outcome.slides.after == pytest.approx(0.01)
    assert outcome.slides.steps == 8
    assert outcome.slides.per_step == pytest.approx(0.008 * 19.5 / 20), 'the mean of net ways'
    assert outcome.largest_slip > outcome.slides.per_step, 'it counts the stance as well'


def test_foot_that_bounces_has_taken_no_step():
    still, bounces = Seen(load=(7.0, 7.0)), Seen(load=(0.0, 14.0))
    run = [*[still] * 9, *[bounces] * 16, *[still] * 9]
    assert judged(run)[-1].slides == Slides()
    assert judged([*[still] * 9, *[bounces] * 17, *[still] * 9])[-1].slides.steps == 1
    bouncing = list(walk(slide=0.008))
    for at in (30, 31):  # of the first step's landing foot, under way in the second
        bouncing[at] = replace(bouncing[at], load=(0.0, 0.0001))
    assert judged(bouncing)[-1].slides.steps == 8


def test_sliding_down_without_a_step_is_a_slip_and_no_walk():
    run = [
        Seen(phi=0.2, forward=s, feet=((s, 0.04, 0.0), (s, -0.04, 0.0)))
        for s in np.linspace(0.0, 0.3, 200)
    ]
    outcome = judged(run)[-1]
    assert outcome.verdict == 'slipped'
    assert outcome.distance == pytest.approx(0.3)
    assert outcome.slip_distance == pytest.approx(0.3)
    assert outcome.largest_slip == pytest.approx(0.15)  # half the load
    assert outcome.slides == (pytest.approx(0.3), 0.0, 0.0, 0), 'all of it before a step'


@pytest.mark.parametrize(('slide', 'stays'), [(0.05, True), (0.07, False)])
@pytest.mark.parametrize('walks', [False, True])
def test_a_robot_that_slides_by_a_step_on_both_feet_is_not_up_even_if_it_bounces(
    slide, stays, walks
):
    first = [*walk()] if walks else []
    sliding = list(stance(first[-1] if walks else Seen(), slide, 61))
    for at in range(5, 61, 10):
        sliding[at] = replace(sliding[at], load=(0.0, 14.0))
    outcome = judged([*first, *sliding])[-1]
    assert outcome.largest_slip < 0.05 and not outcome.fell
    assert outcome.stayed_up is stays


STILL = 0.0, -0.04, 0.0  # a foot


@pytest.mark.parametrize(
    'run',
    [
        [Seen(feet=((x, 0.04, 0.0), STILL), load=(0.5, 14.0)) for x in np.linspace(0.0, 1.0, 50)],
        [Seen(feet=((0.001 * (k % 2), 0.04, 0.0), STILL)) for k in range(401)],
        [
            Seen(
                phi=0.1,
                foot_pitch=(angle, 0.0),
                feet=((0.054 * (1.0 - cos(angle)), 0.04, 0.054 * sin(angle)), STILL),
            )
            for angle in np.linspace(0.0, 0.5, 30)
        ],
    ],
    ids=['in the air', 'trembling', 'over its toe'],
)
def test_a_foot_that_stays_or_is_in_the_air_does_not_slip(run):
    assert judged(run)[-1].slip_distance == pytest.approx(0.0, abs=1e-12)


@settings(max_examples=20)
@given(st.floats(0.0, tau))
def test_falling_in_any_direction(direction):
    angles = np.linspace(0.0, pi / 2, 31)
    run = [Seen(lean=angle * cos(direction), roll=angle * sin(direction)) for angle in angles]
    outcomes = judged(run)
    at = next(k for k, outcome in enumerate(outcomes) if outcome.verdict == 'fell')
    tilts = [Rotation.from_quat(seen.signals[TRUE_POSE][3:]).apply((0, 0, 1))[2] for seen in run]
    assert tilts[at] < cos(pi / 4) <= tilts[at - 1] + 1e-9
    assert outcomes[-1].fell_at == pytest.approx(at * 0.015)


@pytest.mark.parametrize(('samples', 'verdict'), [(1, 'stood'), (19, 'stood'), (22, 'fell')])
def test_a_robot_that_rises_within_the_fall_time_has_not_fallen(samples, verdict):
    outcomes = judged([Seen()] * 10 + [Seen(lean=1.0)] * samples + [Seen()] * 10)
    assert outcomes[10].verdict == 'fell'  # until it rises
    assert outcomes[-1].verdict == verdict
    assert outcomes[-1].fell_at == (None if verdict == 'stood' else pytest.approx(0.15))
    assert outcomes[-1].largest_pitch == pytest.approx(1.0), 'from the vertical'


@given(st.floats(-3.1, 3.1))
def test_the_largest_pitch_is_that_in_the_heading_of_the_robot(heading):
    run = [Seen(heading=heading), Seen(heading=heading, lean=-0.3)]
    assert judged(run)[-1].largest_pitch == pytest.approx(0.3)
    assert judged([replace(run[0], roll=0.3)])[-1].largest_pitch == pytest.approx(0.0, abs=1e-9)


def test_sinking_to_the_ground_is_a_fall_and_walking_downhill_is_not():
    assert judged([Seen(), Seen(height=0.6 * HEIGHT)])[-1].verdict == 'stood'
    assert judged([Seen(), Seen(height=0.49 * HEIGHT)])[-1].verdict == 'fell'
    far = judged(walk(steps=40, phi=radians(15.0)))[-1]  # 0.26 m down, its whole height
    assert far.verdict == 'walked'


def test_a_fall_outranks_a_slip_and_keeps_both_figures():
    run = list(walk(slide=0.02))
    run += [replace(run[-1], lean=1.0), replace(run[-1], forward=9.0, lean=3.0, rate=50.0)]
    outcomes = judged(run)
    assert outcomes[-3].verdict == 'slipped'
    last = outcomes[-1]
    assert (last.verdict, last.fell) == ('fell', True)
    assert last.slip_distance == outcomes[-3].slip_distance > 0.02
    assert last.distance == outcomes[-3].distance
    assert last is outcomes[-2]  # what comes after a fall does not count


def test_drift_is_to_the_left():
    outcome = judged([Seen(phi=0.15), Seen(phi=0.15, forward=0.05, left=0.03)])[-1]
    assert (outcome.distance, outcome.lateral_drift) == pytest.approx((0.05, 0.03))


def vibration(rates, parameters=None):
    still, monitor = Seen().signals, OutcomeMonitor(parameters or MonitorParameters())
    for rate in rates:
        outcome = monitor.update(0, still | {TRUE_RATE: (0.0, rate, 0.0)})
    return outcome.vibration


@pytest.mark.parametrize('frequency', [2.0, 9.0])
def test_vibration_agrees_with_scipy(frequency):
    rates = np.random.default_rng(0).normal(size=300)
    high = sosfilt(butter(16, frequency, 'highpass', fs=1.0 / 0.015, output='sos'), rates)
    assert vibration(rates, MonitorParameters(vibration_frequency=frequency)) == pytest.approx(
        np.sqrt(np.mean(high**2)), rel=1e-9
    )


def test_vibration_passes_the_stated_share_of_lines_of_the_gait():
    time = 0.015 * np.arange(10_000)
    for multiple, share in ((1, 0.0), (2, 0.10), (2.5, 0.96)):
        passed = vibration(np.sin(2.0 * np.pi * multiple * GAIT_FREQUENCY * time))
        assert passed * np.sqrt(2.0) == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize('idle', [0, 1000])
def test_vibration_is_that_of_the_motion_however_long_it_stands_after_it(idle):
    rates = np.random.default_rng(0).normal(size=100)
    still, monitor = Seen().signals, OutcomeMonitor(MonitorParameters(motion_end=1.5))
    for step, rate in enumerate([*rates, *np.zeros(idle)], 1):
        outcome = monitor.update(step * 15_000_000, still | {TRUE_RATE: (0.0, rate, 0.0)})
    assert outcome.vibration == vibration(rates) > 0.0


@pytest.mark.parametrize('wrong', [{'height': float('nan')}, {'rate': float('inf')}])
def test_an_observation_that_is_not_finite_is_refused(wrong):
    with pytest.raises(KhrError, match='observation'):
        OutcomeMonitor(MonitorParameters()).update(0, Seen(**wrong).signals)


@pytest.mark.parametrize(
    ('enabled', 'verdicts'), [(True, ('walked', 'upright')), (False, ('fell', 'fell'))]
)
def test_a_fall_is_sensed_and_a_walk_is_none(enabled, verdicts):
    scenario = load_scenario('walk_8.88deg_ka12').changed(
        {
            ('ankle_controller', 'enabled'): enabled,
            ('simulator', 'stop_when_tilted_deg'): 180.0,
            ('simulator', 'duration'): 8.0,
            ('simulator', 'engine'): 'mujoco',
        }
    )
    monitor, found = SensedMonitor(scenario.table(MonitorParameters)), []

    def watch(truth, loop, _):
        signals = {topic: loop.signals[topic] for topic in SENSED}
        found.append(monitor.update(truth.stamp_ns, signals).verdict)

    assert (run_offline(scenario, watch).verdict, found[-1]) == verdicts


@pytest.mark.parametrize(
    ('course', 'verdict'),
    [
        ([(0.1, 4.0, 200), (0.1, 0.0, 200)], 'upright'),  # lifted by hand
        ([(0.1, 4.0, 200), (5.0, 4.0, 10), (0.1, 4.0, 200)], 'upright'),  # stumbles
        ([(0.1, 4.0, 200), (5.0, 4.0, 10), (0.1, 0.0, 100)], 'fell'),
    ],
)
def test_a_sensed_fall_takes_a_fast_turn_and_then_no_load(course, verdict):
    monitor, stamp_ns = SensedMonitor(MonitorParameters()), 0
    for rate, force, count in course:
        signals = {GYRO: (0.0, rate, 0.0), **dict.fromkeys(FOOT_FORCES, (0.0, 0.0, force))}
        for _ in range(count):
            stamp_ns += PERIOD_NS
            outcome = monitor.update(stamp_ns, signals)
    assert outcome.verdict == verdict
