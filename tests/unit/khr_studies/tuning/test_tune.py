"""The search for gains on invented robots whose best gains are known, and what it writes."""

from contextlib import nullcontext
from dataclasses import replace
from math import inf

import pandas as pd
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError, RunError
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import with_seed
from khr_studies.measuring.ensemble_file import Member
from khr_studies.measuring.optimiser import evolution
from khr_studies.measuring.run_table import run_table
from khr_studies.tuning import page as tune_page
from khr_studies.tuning import study
from khr_studies.tuning.figure import front_picture
from khr_studies.tuning.study import (
    GAINS,
    MERITS,
    PLACEMENT,
    Question,
    Tuning,
    parameter_changes,
    places,
    summarise,
    tune,
)
from khr_sweeps.trial import Row
from tests.fakes.jobs import HerePool

K_A, K_H = (axis.name for axis in GAINS)

WALK = scenarios.load_scenario('walk_7.68deg_ka12')


@pytest.fixture
def invented(monkeypatch):
    """A robot that slips less and vibrates more with more ankle gain, until it falls.

    It stays up with 4 to 15, and with light rotors with 10 to 20.
    """
    runs = []

    def attempt(scenario: Scenario) -> Row:
        runs.append(scenario)
        ankle = scenario.table(AnkleControllerParameters)
        hip = scenario.table(HipControllerParameters)
        k_a = ankle.gain if ankle.enabled else 0.0
        k_h = hip.gain if hip.enabled else 0.0
        light = scenario.table(RunParameters).rotor_inertia < 0.004
        least, most = (10.0, 20.0) if light else (4.0, 15.0)
        up = least <= k_a <= most
        vibration = 0.05 + 0.01 * k_a + 0.002 * k_h
        return {
            'stayed_up': up,
            'lasted': 1.0 if up else min(k_a, most) / 40.0,
            'slip_m': 0.03 - 0.001 * k_a,
            'vibration_rad_s': vibration,
        }

    monkeypatch.setattr(
        'khr_studies.measuring.kept_pool.local_pool', lambda *_: nullcontext(HerePool())
    )
    monkeypatch.setattr(study, 'attempt', attempt)
    return runs


def test_the_least_slip_that_stays_up_is_found_and_a_front_to_the_least_vibration(
    invented, tmp_path
):
    answer = tune(Question(WALK, GAINS, candidates=160, seeds=2), 1, tmp_path)
    assert 14.0 <= answer.best[K_A] <= 15.0 and answer.best['up'] == 1.0
    assert answer.before[[K_A, K_H]].tolist() == [12.0, 0.0]
    assert answer.confirmed[K_A] == answer.best[K_A]
    assert len(invented) == 2 * len(answer.tried) + 2, 'nothing is run twice'
    assert not answer.tried.duplicated([K_A, K_H]).any()
    seeds = {run.table(RunParameters).seed for run in invented}
    assert seeds == {0, 1, 2, 3}, 'the best is confirmed with seeds of its own'
    # Less gain vibrates less and slips more: the second search goes there.
    gains = answer.front[K_A].tolist()
    assert gains[0] >= 14.0 and gains[-1] <= 5.5 and gains == sorted(gains, reverse=True)
    assert answer.best.name in answer.front.index


def test_a_search_repeats_and_resumes(invented, tmp_path):
    question = Question(WALK, GAINS, candidates=32, seeds=1)
    first = tune(question, 1, tmp_path).tried
    count = len(invented)
    assert tune(question, 1, tmp_path).tried.equals(first) and len(invented) == count
    assert tune(question, 1, tmp_path / 'other').tried.equals(first)
    assert len(invented) == 2 * count
    assert not tune(replace(question, seed=1), 1, tmp_path).tried.equals(first)


def test_robust_gains_hold_for_every_robot(invented, tmp_path):
    """One robot stands with 4 to 15, the other with 10 to 20."""
    robots = (
        Member({'simulator.rotor_inertia': 0.006}, {}),
        Member({'simulator.rotor_inertia': 0.002}, {}),
    )
    answer = tune(Question(WALK, GAINS, robots, seeds=1, candidates=96), 1, tmp_path)
    assert 10.0 <= answer.best[K_A] <= 15.0 and answer.best['up'] == 1.0
    only = tune(Question(WALK, GAINS, robots[1:], seeds=1, candidates=96), 1, tmp_path)
    assert only.best[K_A] > 18.0
    assert dict(answer.scenario.values['simulator']) == dict(WALK.values['simulator'])


def table(*candidates):
    """Return the summary of candidates, a list of runs each, or of lists of runs, by robot."""
    rows = [
        {K_A: float(place), K_H: 0.0, 'robot': robot, **run}
        for place, robots in enumerate(candidates)
        for robot, runs in enumerate(robots if isinstance(robots[0], list) else [robots])
        for run in runs
    ]
    return summarise(run_table(rows), [K_A, K_H])


def trial(stayed_up=True, lasted=1.0, slip=0.01, vibration=0.1):
    return {'stayed_up': stayed_up, 'lasted': lasted, 'slip_m': slip, 'vibration_rad_s': vibration}


TRIALS = st.builds(
    trial, st.booleans(), st.floats(0.0, 1.0), st.floats(0.0, 0.1), st.floats(0.0, 0.5)
)


@given(st.lists(st.lists(TRIALS, min_size=2, max_size=2), min_size=1, max_size=8))
def test_no_candidate_on_the_front_is_beaten_and_the_choice_is_on_it(candidates):
    tried = table(*candidates)
    answer = Tuning(Question(WALK, GAINS), tried, tried.iloc[0])
    up = answer.survivors[MERITS].to_numpy().tolist()
    front = answer.front[MERITS].to_numpy().tolist()
    for each in up:
        beaten = any(o[0] <= each[0] and o[1] <= each[1] and o != each for o in up)
        assert (each in front) != beaten
    best, before = answer.best, answer.before
    if best['up']:
        assert best[MERITS].tolist() in front
    if before['up'] == best['up'] > 0.0:
        assert not (best[MERITS] > before[MERITS]).all(), 'never worse in both than before'


def test_more_seeds_up_come_first_then_slip_then_vibration():
    ranked = table(
        [trial(slip=0.0099, vibration=0.2)] * 2,
        [trial(slip=0.0102, vibration=0.1)] * 2,
        [trial(slip=0.02, vibration=0.0)] * 2,
        [trial(slip=0.0), trial(stayed_up=False, lasted=0.9)],
        [trial(slip=0.0), trial(stayed_up=False, lasted=0.1)],
        [trial(stayed_up=False, lasted=0.5)] * 2,
    )
    assert places(ranked) == [0, 1, 2, 3, 4, 5]
    assert places(ranked, 'vibration')[2] == 0
    assert places(ranked.iloc[[0, 0]]) == [0, 0]


def test_a_slip_less_by_a_fraction_of_a_millimetre_is_not_worth_more_vibration():
    merits = ((0.0036, 0.0731), (0.0024, 0.0843), (0.0026, 0.07))
    tried = table(*([trial(slip=slip, vibration=vibration)] for slip, vibration in merits))
    assert Tuning(Question(WALK, GAINS), tried, tried.iloc[0]).best.name == 2


def test_the_worst_robot_counts():
    both = table([[trial(slip=0.01)], [trial(slip=0.03), trial(slip=0.05)]])
    assert both['slip_m'][0] == pytest.approx(0.04) and both['up'][0] == 1.0
    assert table([trial(stayed_up=False, slip=None)])['slip_m'][0] == inf


def test_the_optimiser_of_all_searches_takes_a_single_constant_too():
    optimiser = evolution([0.5], 0.3, 1, 8)
    for _ in range(40):
        shares = optimiser.ask()
        optimiser.tell(shares, [sum(each) for each in shares])
    assert all(0.0 <= share < 0.02 for (share,) in shares)


@given(st.floats(-0.2, 1.2), st.sampled_from(GAINS + PLACEMENT))
def test_values_stay_in_their_range_and_on_their_steps(share, axis):
    value = axis.at(share)
    assert axis.low <= value <= axis.high
    assert value / axis.step == pytest.approx(round(value / axis.step), abs=1e-6)
    assert abs(axis.share(value) - min(max(share, 0.0), 1.0)) <= axis.step / (axis.high - axis.low)


def test_a_gain_of_nothing_switches_its_controller_off():
    off = WALK.changed(parameter_changes(GAINS, (0.0, 5.0)))
    assert not off.table(AnkleControllerParameters).enabled
    assert off.table(HipControllerParameters).enabled
    assert [axis.value_in(off) for axis in GAINS] == [0.0, 5.0]
    assert [axis.value_in(WALK) for axis in GAINS] == [12.0, 0.0]


def test_the_files_hold_the_answer(invented, tmp_path, monkeypatch):
    question = Question(WALK, (*GAINS, *PLACEMENT), candidates=16, seeds=1)
    answer = tune(question, 1, tmp_path / 'jobs')
    text = tune_page.write(answer, tmp_path)
    path = tmp_path / 'walk_7.68deg_ka12_tuned.yaml'
    assert str(path) in text and text.startswith('K_A ')
    again = scenarios.load_scenario(str(path))
    assert again.values == answer.scenario.values and 'tuned: K_A' in again.title
    assert set(yaml.safe_load(path.read_text())) == {f'/**/{node}' for node in again.values}
    assert (tmp_path / 'front.png').stat().st_size > 10_000
    page = (tmp_path / 'tune.md').read_text(encoding='utf-8')
    assert page.startswith('# Gains for walk_7.68deg_ka12\n')
    assert '| before | 12 | 0 |' in page and '| chosen, other seeds |' in page
    assert 'candidates, the unchanged scenario among them, each with 1 seed on the robot' in page
    assert 'of the worst robot' not in page
    assert front_picture(answer).get_suptitle().endswith(' of the runs.')
    far = answer.best.copy()
    far['vibration_rad_s'] = 1.0
    tried = pd.concat([answer.tried, far.to_frame().T.astype(float)], ignore_index=True)
    assert '1 of them lie beyond' in front_picture(replace(answer, tried=tried)).get_suptitle()


@pytest.mark.parametrize(
    ('candidates', 'generations'), [(8, [1, 0]), (23, [1, 1]), (24, [2, 1]), (64, [4, 4])]
)
def test_no_more_candidates_are_measured_than_asked_for(
    candidates, generations, invented, tmp_path
):
    question = Question(WALK, GAINS, candidates=candidates, seeds=1)
    assert [*question.generations.values()] == generations
    assert len(tune(question, 1, tmp_path).tried) <= 1 + candidates


def test_a_search_that_finds_nothing_better_says_so(invented, tmp_path):
    found = tune(Question(WALK, GAINS, candidates=16, seeds=1), 1, tmp_path / 'jobs')
    worse = found.before.copy()
    worse['up'], worse[K_A] = 0.1, 13.0
    tried = pd.DataFrame([found.before, worse]).reset_index(drop=True)
    for up, silent in (([1.0, 0.1], False), ([0.5, 1.0], True)):
        text = tune_page.write(replace(found, tried=tried.assign(up=up)), tmp_path)
        says = "None of 1 other candidate is better than the scenario's own values."
        assert (says in text.splitlines()) != silent


def test_without_any_survivor_nothing_is_written(tmp_path):
    fallen = table([trial(stayed_up=False, lasted=0.3)])
    lost = Tuning(Question(WALK, GAINS), fallen, fallen.iloc[0])
    with pytest.raises(RunError, match='none of 1 candidates stays up') as refusal:
        tune_page.write(lost, tmp_path / 'out')
    assert '\n' not in str(refusal.value) and not (tmp_path / 'out').exists()


@pytest.mark.parametrize(
    ('change', 'word'),
    [({'seeds': 0}, '--seeds'), ({'candidates': 7}, '--candidates'), ({'seed': -1}, '--seed')],
)
def test_numbers_are_refused_in_one_line(change, word):
    with pytest.raises(KhrError, match=word) as refusal:
        Question(WALK, GAINS, **change)
    assert '\n' not in str(refusal.value)


@pytest.mark.parametrize(
    ('key', 'value', 'accepted'), [('seed', 5, '0'), ('initial_tilt_deg', 2.0, '0 or 0.3')]
)
def test_a_value_that_each_run_of_the_search_replaces_is_refused(key, value, accepted):
    with pytest.raises(
        KhrError, match=rf'simulator\.{key}: {value} .*; accepted: {accepted}: the'
    ):
        Question(WALK.changed({('simulator', key): value}), GAINS)
    whole = {('simulator', key): value for key, value in WALK.whole('simulator').items()}
    Question(WALK.changed(whole), GAINS)  # a recorded run states all values
    Question(WALK.changed(dict(with_seed(0))), GAINS)


@pytest.mark.parametrize(
    ('members', 'gait', 'says'),
    [
        ([], False, 'no robot'),
        ([Member({'gait.com_lifted': 0.01}, {})], True, r'gait\.com_lifted.*without --gait'),
        ([Member({'gait.wings': 2.0}, {})], False, 'wings'),
    ],
)
def test_an_ensemble_that_cannot_be_searched_is_refused(
    members, gait, says, tmp_path, monkeypatch
):
    monkeypatch.setattr(study, 'read_ensemble', lambda: members)
    numbers = {'seeds': 1, 'candidates': 8, 'seed': 0}
    with pytest.raises(KhrError, match=says):
        tune(study.define_search(WALK, gait=gait, robust=True, **numbers), 1, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_gait_that_the_legs_do_not_reach_is_a_fall_from_the_start():
    out_of_reach = {('gait', 'com_lifted'): 0.025, ('gait', 'com_touchdown'): 0.04}
    run = study.attempt(WALK.changed(out_of_reach))
    assert not run['stayed_up'] and run['lasted'] == 0.0
