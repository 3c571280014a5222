"""The scoreboard: every row of the thesis is there, and what misses is looked into."""

from dataclasses import replace
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.ankle import AnkleControllerParameters
from khr_balance.hip import HipControllerParameters
from khr_bringup.node_registry import table_of
from khr_bringup.scenario import load, shipped
from khr_common import check
from khr_experiments import scoreboard
from khr_experiments.condition import Condition
from khr_experiments.critical import Limit
from khr_experiments.errors import ExperimentError
from khr_experiments.json_file import read_json, write_json
from khr_experiments.published import (
    LIMITS,
    STAGE_1,
    STAGE_2,
    STAGE_3,
    TOLERANCE_DEG,
    TRENDS,
    WALKS,
    walking,
)
from khr_experiments.scoreboard_compare import (
    agrees,
    grows,
    limit_rows,
    order_rows,
    theory_row,
    walk_row,
)
from khr_experiments.scoreboard_rows import Scoreboard
from khr_experiments.scoreboard_runs import lift, slip_mm, vibration, walk
from khr_sim.run_parameters import RunParameters
from tests.fakes.benches import Opposite, Thesis, limits_of_thesis, walked


def test_board_of_the_thesis_itself_passes_every_row():
    board = scoreboard.compare(Thesis())
    assert not [row for row in board.rows if row.passed is False]
    assert [row.condition for row in board.limits[:-1]] == [row.condition.title for row in LIMITS]
    assert [row.thesis for row in board.walks] == [row.thesis for row in WALKS]
    assert [row.what for row in board.trends] == [row.what for row in TRENDS]
    assert sum(row.passed is None for row in board.walks) == 2, 'the rubber twins'
    assert board.explanations == ()


def test_board_measures_every_limit_both_ways():
    bench = Thesis()
    board = scoreboard.compare(bench)
    assert [width.condition for width in board.widths] == [row.condition.title for row in LIMITS]
    for width, row in zip(board.widths, LIMITS, strict=True):
        assert width.downhill_deg == row.thesis_deg
        up = replace(row.condition, uphill=True)
        assert width.uphill_deg == bench.limit(up, row.thesis_deg).mean
        assert any(asked[1] == up for asked in bench.asked), 'it runs beside the others'


def test_scoreboard_is_the_same_after_its_file(tmp_path):
    for bench in (Thesis(amiss=walking(18.0)), Opposite()):
        board = scoreboard.compare(bench)
        write_json(tmp_path / 'new' / 'board.json', board)
        assert read_json(tmp_path / 'new' / 'board.json', Scoreboard) == board


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        (None, 'No such file or directory'),
        ('{"seeds": 3}', r'not a scoreboard of this version \(limits: Field required\)'),
        ('no JSON', r'not a scoreboard of this version \(Invalid JSON: .*\)'),
    ],
)
def test_file_that_holds_no_scoreboard_is_one_line(tmp_path, text, said):
    path = tmp_path / 'board.json'
    if text is not None:
        path.write_text(text)
    with pytest.raises(ExperimentError, match=rf'^\S*board\.json: {said}; accepted: .*$'):
        read_json(path, Scoreboard)


def test_limit_that_misses_stays_and_is_looked_into():
    board = scoreboard.compare(Thesis(amiss=walking(18.0)))
    (row,) = [row for row in board.limits if row.passed is False]
    assert row.condition == 'walk, K_A 18'
    assert row.difference_deg == pytest.approx(-7.7)
    (explanation,) = board.explanations
    assert explanation.condition == row.condition
    assert [shift.change for shift in explanation.shifts] == [
        name for name, _ in scoreboard.CHANGES['walk']
    ]
    quick = scoreboard.compare(Thesis(amiss=walking(18.0)), explain=False)
    assert quick.explanations is None and quick.widths == ()


@pytest.mark.parametrize('motion', scoreboard.CHANGES)
def test_experiments_are_values_that_the_tables_accept(motion):
    for _, changes in scoreboard.CHANGES[motion]:
        for (node, key), value in changes:
            check(table_of(node), key, value)
        replace(Condition(motion, 12.0, 13.0), changes=changes).scenario(5.0)


def test_limit_passes_within_its_tolerance_and_marks_what_was_fitted():
    limits = limits_of_thesis()
    limits[STAGE_1] = Limit((6.85, 6.85), (), 0.1)
    limits[STAGE_2] = Limit((8.55, 8.55), (), 0.1)
    limits[STAGE_3] = Limit((10.2, 10.2), (), 0.1)
    rows = limit_rows(limits, {})
    assert [row.passed for row in rows[:3]] == [True, False, None]
    assert [row.undecided for row in rows[:3]] == [False, False, True]
    assert [row.kind for row in rows] == [
        'fitted' if row.fitted else 'predicted' for row in LIMITS
    ]


@given(st.floats(-3.0, 3.0), st.floats(0.0, 1.0), st.floats(-3.0, 3.0))
def test_limit_is_undecided_where_its_interval_or_another_robot_reaches_the_tolerance(
    difference, half, other
):
    found = agrees(difference, half)
    assert (found is True) == (abs(difference) + half <= TOLERANCE_DEG)
    assert (found is False) == (abs(difference) - half > TOLERANCE_DEG)
    with_other = agrees(difference, half, [other])
    assert with_other == found or (found is False and with_other is None)
    assert agrees(difference, inf) is (abs(difference) <= TOLERANCE_DEG)


def test_miss_of_one_robot_is_undecided_if_another_that_fits_agrees():
    limits = limits_of_thesis()
    limits[STAGE_1] = Limit((8.0, 8.0), ())
    for spread, passed in (({}, False), ((6.5, 8.0), None), ((7.5, 8.0), False)):
        by_title = {STAGE_1.title: spread} if spread else {}
        assert limit_rows(limits, by_title)[0].passed is passed


def test_order_is_strict_and_undecided_where_intervals_overlap():
    limits = limits_of_thesis()
    limits[STAGE_3] = limits[STAGE_2]
    standing, walking_order = order_rows(limits)
    assert standing.passed is None and standing.undecided
    assert walking_order.passed
    limits[STAGE_3] = Limit((6.0, 6.0), ())
    assert order_rows(limits)[0].passed is False


def test_walk_that_only_some_seeds_survive_is_undecided():
    row = walk_row(by_thesis('slips again'), [walked('slipped'), walked('fell')])
    assert row.passed is None and row.undecided


def by_thesis(text):
    return next(row for row in WALKS if row.thesis == text)


def test_pendulum_agrees_with_the_thesis():
    assert theory_row().passed


def test_walk_is_judged_on_all_that_is_published_of_it():
    by_text = {row.thesis: row for row in WALKS}
    slipping = by_text['slips again']
    assert walk_row(slipping, [walked('slipped')] * 2).passed
    assert walk_row(slipping, [walked('walked')] * 2).differences == ('does not slip',)
    assert walk_row(slipping, [walked('fell')] * 2).differences == ('falls',)
    falling = by_text['unstable (beyond 10.2 deg)']
    assert walk_row(falling, [walked('fell')] * 2).passed
    assert walk_row(falling, [walked('walked')] * 2).differences == ('does not fall',)
    flat = by_text['walks, one dominant peak at 1.73 Hz']
    assert walk_row(flat, [walked('walked', 1.8)] * 2).passed
    assert not walk_row(flat, [walked('walked', 1.2)] * 2).passed
    rubber = next(row for row in WALKS if row.survives is None)
    assert walk_row(rubber, [walked('fell')]).passed is None


def test_growth_needs_numbers():
    assert grows([1.0, 2.0, 3.0])
    assert not grows([1.0, 1.0])
    assert not grows([1.0, 1.1, 1.3], least=0.15)
    assert grows([1.0, 1.2, 1.4], least=0.15)
    assert not grows([1.0, float('nan')])


def test_figures_are_of_the_walks_without_a_fall():
    walks = [walked('walked', slip=0.01, vibration=0.2), walked('fell', slip=9.0, vibration=9.0)]
    assert slip_mm(walks) == pytest.approx(10.0)
    assert vibration(walks) == pytest.approx(0.2)


def test_every_walk_and_lift_limit_of_the_thesis_has_a_scenario_to_run():
    tables = [
        tuple(
            map(
                load(str(path)).table,
                (RunParameters, AnkleControllerParameters, HipControllerParameters),
            )
        )
        for path in shipped()
    ]
    ours = {
        (s.inclination_deg, s.surface, a.enabled and a.gain, h.enabled and h.gain)
        for s, a, h in tables
    }
    for row in WALKS:
        if row.survives is not False:
            assert (
                row.inclination_deg,
                row.condition.surface,
                row.condition.ankle_gain,
                row.condition.hip_gain,
            ) in ours


def test_measurements_are_of_the_run():
    slow = (
        (('gait', 'start_delay'), 0.0),
        (('gait', 'end_pause'), 0.0),
        (('gait', 'cycles'), 3),
        (('gait', 'cycle_period'), 1.5),
        (('gait', 'stride'), 0.02),
        (('gait', 'lift'), 0.008),
        (('gait', 'sway'), 0.005),
    )
    found = walk(Condition(changes=slow), 0.0, 0)
    assert found.survived
    assert found.peaks
    assert all(0.5 / 1.5 < peak.frequency < 15.5 for peak in found.peaks)
    quick = ((('gait', 'hold_time'), 1.0), (('gait', 'end_pause'), 0.0))
    one = lift(Condition('leg_lift', changes=quick), 1.0, 0)
    assert one.survived
    weight = 1.5 * 9.81
    assert one.toe + one.heel == pytest.approx(weight, rel=0.05)
    assert -1.0 < one.share < 1.0


def test_arguments_are_refused():
    for seeds, jobs, word in ((1, 1, '--seeds'), (2, 0, '--jobs')):
        with pytest.raises(ExperimentError, match=word):
            scoreboard.scoreboard(seeds, 0.1, jobs)
