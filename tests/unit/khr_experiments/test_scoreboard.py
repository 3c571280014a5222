"""The scoreboard: every row of the thesis is there, and what misses is told."""

from dataclasses import replace

import pytest

from khr_balance.ankle import AnkleControllerParameters
from khr_balance.hip import HipControllerParameters
from khr_bringup.node_registry import table_of
from khr_bringup.scenario import load, shipped
from khr_common import check
from khr_experiments import scoreboard
from khr_experiments.critical import Condition, Limit
from khr_experiments.errors import ExperimentError
from khr_experiments.published import LIMITS, STAGE_1, STAGE_2, STAGE_3, TRENDS, WALKS, walking
from khr_experiments.scoreboard_compare import grows, limit_rows, order_rows, theory_row, walk_row
from khr_experiments.scoreboard_runs import lift, slip_mm, vibration, walk
from khr_sim.run_parameters import RunParameters
from tests.fakes.benches import Thesis, limits_of_thesis, walked


def test_board_of_the_thesis_itself_passes_every_row():
    page, summary = scoreboard.board(Thesis())
    assert '**miss**' not in page
    passed, judged = summary.split()[0], summary.split()[2]
    assert passed == judged
    for row in (*LIMITS, *WALKS, *TRENDS):
        text = row.condition.title if row in LIMITS else getattr(row, 'thesis', '')
        assert text in page
    assert page.count('no number published') >= 2, 'the rubber twins'


def test_limit_that_misses_stays_and_is_looked_into():
    page, _ = scoreboard.board(Thesis(amiss=walking(18.0)))
    (line,) = [line for line in page.splitlines() if line.startswith('| 5 | walk, K_A 18')]
    assert '**miss**' in line
    assert '-7.70' in line
    assert 'No limit misses' not in page
    assert all(name in page for name, _ in scoreboard.EXPERIMENTS['walk'])


@pytest.mark.parametrize('motion', scoreboard.EXPERIMENTS)
def test_experiments_are_values_that_the_tables_accept(motion):
    for _, changes in scoreboard.EXPERIMENTS[motion]:
        for (node, key), value in changes:
            check(table_of(node), key, value)
        replace(Condition(motion, 12.0, 13.0), changes=changes).scenario(5.0)


def test_limit_passes_within_its_tolerance_and_says_what_was_fitted():
    limits = limits_of_thesis()
    limits[STAGE_1] = Limit((7.05, 7.05), ())
    limits[STAGE_2] = Limit((8.35, 8.35), ())
    rows = limit_rows(limits)
    assert [row.passed for row in rows[:2]] == [True, False]
    assert [row.kind for row in rows] == [
        'fitted' if row.fitted else 'predicted' for row in LIMITS
    ]


def test_order_is_strict():
    limits = limits_of_thesis()
    limits[STAGE_3] = limits[STAGE_2]
    standing, walking_order = order_rows(limits, 0.1)
    assert not standing.passed
    assert walking_order.passed


def test_pendulum_agrees_with_the_thesis():
    assert theory_row().passed


def test_walk_is_judged_on_all_that_is_published_of_it():
    by_text = {row.thesis: row for row in WALKS}
    slipping = by_text['slips again']
    assert walk_row(slipping, [walked('slipped')] * 2).passed
    assert walk_row(slipping, [walked('walked')] * 2).difference == 'does not slip'
    assert walk_row(slipping, [walked('fell')] * 2).difference == 'falls'
    falling = by_text['unstable (beyond 10.2 deg)']
    assert walk_row(falling, [walked('fell')] * 2).passed
    assert walk_row(falling, [walked('walked')] * 2).difference == 'does not fall'
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


def test_arguments_are_refused(tmp_path):
    for seeds, jobs, word in ((1, 1, '--seeds'), (2, 0, '--jobs')):
        with pytest.raises(ExperimentError, match=word):
            scoreboard.write(tmp_path / 'page.md', seeds, 0.1, jobs)
