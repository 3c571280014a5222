"""The critical inclination: the search, its statistics, and what a trial does."""

import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.scenario.derived import start_of_lift
from khr_common import KhrError
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring import critical
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.critical import (
    ENDS,
    ONE_SEED_DEG,
    RAGGED,
    VIBRATES,
    Limit,
    limit_text,
    measure_limit,
    run_condition,
    write_limit,
)
from khr_studies.measuring.run_table import run_table
from tests.fakes.benches import full_outcome, outcome
from tests.fakes.jobs import HerePool


def test_interval_is_students_over_what_bisection_and_raggedness_leave():
    limit = Limit((5.0, 6.0, 7.0), 0.2)
    assert limit.mean == 6.0
    rest = 1.96 * np.hypot(0.2 / np.sqrt(12.0), RAGGED)
    assert limit.half_width == pytest.approx(np.hypot(4.302653 / np.sqrt(3.0), rest), rel=1e-6)
    assert Limit((6.0, 6.0, 6.0), 0.2).half_width == pytest.approx(rest)
    assert Limit((5.0,), 0.2).half_width == pytest.approx(np.hypot(rest, 1.96 * ONE_SEED_DEG))


def test_seeds_search_on_lattices_of_their_own(monkeypatch, capsys, tmp_path):
    def run(condition, inclination_deg, seed):
        return full_outcome('walked' if inclination_deg < 7.5 else 'fell')

    monkeypatch.setattr(critical, 'run_condition', run)
    limit = measure_limit(Condition(), 6, 0.2, HerePool())
    assert len(set(limit.of_seeds)) == 6
    assert limit.of_seeds == pytest.approx([7.5] * 6, abs=0.1)
    assert limit.tolerance == 0.2
    assert len(capsys.readouterr().err.splitlines()) == 6, 'one line a seed'
    assert limit.highest['seed'].is_unique and len(limit.highest) == 6
    for name in ('runs.csv', 'limit.json'):
        write_limit(limit, tmp_path / name)
    content = json.loads((tmp_path / 'limit.json').read_text())
    assert content['limit_deg'] == pytest.approx(limit.mean) and content['ended'] == ''
    assert len(content['runs']) == len(pd.read_csv(tmp_path / 'runs.csv')) == len(limit.runs)


def test_the_runs_of_one_seed_have_the_columns_of_those_of_several(monkeypatch):
    monkeypatch.setattr(critical, 'run_condition', lambda *_: full_outcome('fell'))
    one, two = (measure_limit(Condition(), seeds, 0.8, HerePool()).runs for seeds in (1, 2))
    assert [*one.columns] == [*two.columns]


@given(
    edge=st.one_of(st.floats(-1.0, 21.0), st.sampled_from((0.1, 19.9))),
    tolerance=st.sampled_from((0.1, 0.8)),
)
def test_every_run_of_a_search_is_within_its_range_and_an_end_of_it_is_called_so(edge, tolerance):
    def run(condition, inclination_deg, seed):
        return full_outcome('walked' if inclination_deg <= edge else 'fell')

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(critical, 'run_condition', run)
        limit = measure_limit(Condition(), 4, tolerance, HerePool())
    assert limit.runs['inclination_deg'].between(*ENDS).all()
    text, beyond = 'the range ended: 4 of 4 seeds {} up at {} deg', ''
    if not ENDS[0] <= edge < ENDS[1]:
        beyond = text.format(*(('not', 0) if edge < ENDS[0] else ('still', 20)))
    assert limit.ended == beyond
    assert ('range' in repr(limit)) == bool(beyond) == ('range' in limit_text('walk', limit))


def test_slip_and_vibration_are_reported_of_the_steepest_ground_survived():
    runs = run_table(
        {'inclination_deg': phi, 'seed': seed, **outcome(verdict, vibration=vibration)}
        for phi, seed, verdict, vibration in (
            (5.0, 0, 'slipped', 0.1),
            (5.5, 0, 'walked', 0.1),
            (5.6, 0, 'fell', 9.0),
            (6.0, 1, 'slipped', 2.0 * VIBRATES),
            (6.5, 1, 'fell', 0.1),
            (7.0, 1, 'walked', 0.1),
        )
    )
    limit = Limit((5.55, 6.25), runs=runs)
    assert limit.highest['inclination_deg'].tolist() == [5.5, 6.0]
    assert (limit.slipped, limit.vibrated) == (0.5, 0.5)
    assert 'slips with 1 of 2 seeds, vibrates with 1 of 2 seeds' in limit_text('walk', limit)
    assert np.isnan(Limit((5.55, 6.25)).slipped), 'no seed stayed up'
    assert 'slips: never stayed up' in limit_text('walk', Limit((5.55, 6.25)))


def test_condition_uphill_is_the_same_ground_the_other_way():
    up = Condition('walk', 12.0, uphill=True)
    assert up.scenario(3.0).table(RunParameters).inclination_deg == -3.0
    assert up.title == 'walk, uphill, K_A 12'


def test_board_is_tilted_under_the_standing_robot_before_it_lifts_a_leg():
    quick = {'shift_time': 0.3, 'lift_time': 0.2, 'lower_time': 0.2, 'hold_time': 0.1}
    quick |= {'lift': 0.003, 'end_pause': 0.0}
    changes = tuple((('gait', name), value) for name, value in quick.items())
    condition = Condition('leg_lift', changes=changes)
    seen = []
    run_condition(
        condition,
        1.0,
        0,
        lambda truth, *_: seen.append(
            (truth.stamp_ns / 1e9, np.degrees(truth.inclination), truth.joint_position[7])
        ),
    )
    time, inclination, hip_roll = np.array(seen).T
    assert inclination[0] == 0.0
    assert inclination[-1] == pytest.approx(1.0)
    before = time < start_of_lift(1.0)
    assert inclination[before][-1] == pytest.approx(1.0)
    assert np.ptp(hip_roll[before]) < 0.02 < np.ptp(hip_roll)


@pytest.mark.parametrize(
    ('condition', 'seeds', 'tolerance', 'word'),
    [
        (Condition(), 0, 0.1, '--seeds'),
        (Condition(), 1, 0.0, '--tolerance'),
        (Condition(surface='ice'), 1, 0.1, 'surface'),
    ],
)
def test_mistakes_are_one_line_before_anything_starts(condition, seeds, tolerance, word):
    with pytest.raises(KhrError, match=word) as refusal:
        measure_limit(condition, seeds, tolerance, HerePool())
    assert '\n' not in str(refusal.value)


def test_an_inclination_has_no_more_digits_than_a_page_shows_of_it():
    """The sums of a bisection end beside the number that a page names, and there another falls."""
    assert 9.8 + 0.4 != 10.2
    assert Condition('walk').scenario(9.8 + 0.4).of('simulator')['inclination_deg'] == 10.2
