"""The scoreboard: every row of the thesis is there, and what misses is looked into."""

from dataclasses import replace
from math import hypot, isfinite, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.node_registry import table_of
from khr_bringup.scenario.scenario import load_scenario, shipped
from khr_common import KhrError, check
from khr_studies.measuring.bench import lift, walk
from khr_studies.measuring.condition import Condition, with_engine
from khr_studies.measuring.critical import Limit
from khr_studies.measuring.json_file import read_json
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import (
    EMPTY_FOOT_MOST,
    LIMITS,
    STAGE_1,
    STAGE_1_READ,
    STAGE_2,
    STAGE_3,
    VISIBLE_SLIDE_MM,
    ThesisTrend,
    ThesisWalk,
    walking,
)
from khr_studies.measuring.thesis_walks import TRENDS, WALKS
from khr_studies.scoreboard import page as scoreboard_page
from khr_studies.scoreboard import study as scoreboard
from khr_studies.scoreboard.limit_rows import (
    TOLERANCE_DEG,
    agrees,
    half_width,
    limit_rows,
    order_rows,
)
from khr_studies.scoreboard.page import QUICK, scoreboard_markdown, summary
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.scoreboard.walk_rows import slips_from_mm, trend_row, walk_row
from tests.fakes.benches import Opposite, Thesis, limits_of_thesis, outcome, walked, walks


@pytest.fixture(scope='module')
def amiss():
    """The board of a bench on which one limit is not the thesis's."""
    return scoreboard.compare(Thesis(amiss=walking(18.0)))


def test_board_of_the_thesis_itself_passes_every_row_and_measures_every_limit_both_ways():
    bench = Thesis()
    board = scoreboard.compare(bench)
    assert not [row for row in board.rows if row['verdict'] == 'missed']
    assert [row['condition'] for row in board.limits[:-1]] == [
        row.condition.title for row in LIMITS
    ]
    assert [row['thesis'] for row in board.walks] == [row.thesis for row in WALKS]
    assert [row['name'] for row in board.trends] == [row.name for row in TRENDS]
    assert {row['verdict'] for row in board.rows} == {'passed', 'unpublished'}
    assert all(row['criterion'] for row in (*board.walks, *board.trends))
    assert [row['kind'] for row in board.limits[:-1]] == [
        'fitted' if row.fitted else 'predicted' for row in LIMITS
    ]
    for row in board.limits + board.standing + board.walks + board.trends:
        assert row['source'], row
    assert board.explanations == []
    assert [width['condition'] for width in board.widths] == [
        row.condition.title for row in LIMITS
    ]
    for width, row in zip(board.widths, LIMITS, strict=True):
        assert width['downhill_deg'] == row.thesis_deg
        up = replace(row.condition, uphill=True)
        assert width['uphill_deg'] == bench.limit(up).mean
        assert any(asked[1] == up for asked in bench.asked), 'it runs beside the others'


def test_page_and_data_hold_the_same_scoreboard(amiss, tmp_path):
    for board in (amiss, scoreboard.compare(Opposite())):
        path = tmp_path / 'new' / 'board.md'
        scoreboard_page.write(board, path)
        again = read_json(path.with_suffix('.json'), Scoreboard)
        assert again == board
        assert path.read_text() == scoreboard_markdown(again, 'board.json')


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        (None, 'No such file or directory'),
        ('{"seeds": 3}', r'not a scoreboard of this version \(limits: Field required\)'),
    ],
)
def test_file_that_holds_no_scoreboard_is_one_line(tmp_path, text, said):
    path = tmp_path / 'board.json'
    if text is not None:
        path.write_text(text)
    with pytest.raises(KhrError, match=rf'^\S*board\.json: {said}; accepted: .*$'):
        read_json(path, Scoreboard)


def test_limit_that_misses_stays_and_is_looked_into(amiss):
    (row,) = [row for row in amiss.limits if row['verdict'] == 'missed']
    assert row['condition'] == 'walk, K_A 18' and row['deg'] == pytest.approx(2.0)
    (explanation,) = amiss.explanations
    assert explanation['condition'] == row['condition']
    changes = [*scoreboard.CHANGES['walk']]
    changes.remove('no offset of the reference')  # the default robot has none
    assert [*explanation['shifts']] == changes
    quick = scoreboard.compare(Thesis(amiss=walking(18.0)), explain=False)
    assert quick.explanations is None and quick.widths == ()


@pytest.mark.parametrize('motion', scoreboard.CHANGES)
def test_experiments_are_values_that_the_tables_accept(motion):
    condition = Condition(motion, 14.0, 13.0)
    for alteration in scoreboard.CHANGES[motion].values():
        changes = alteration(condition.scenario(5.0))
        for (node, key), value in changes:
            check(table_of(node), key, value)
        replace(condition, changes=changes).scenario(5.0)


def test_an_experiment_scales_the_gain_of_its_condition():
    stronger = scoreboard.CHANGES['leg_lift']['force loop 1.5 times as strong']
    gain = ('ankle_controller', 'gain')
    assert stronger(Condition('leg_lift', 14.0, 13.0).scenario(5.0)) == ((gain, 21.0),)
    assert stronger(Condition('leg_lift').scenario(5.0)) == ()


@given(st.floats(-3.0, 3.0), st.floats(0.0, 1.0))
def test_limit_is_undecided_where_its_interval_reaches_over_the_tolerance(difference, half):
    found = agrees(difference, half)
    assert (found is True) == (abs(difference) + half <= TOLERANCE_DEG)
    assert (found is False) == (abs(difference) - half > TOLERANCE_DEG)


def test_standing_limit_misses_while_the_other_foot_carries_load():
    limits = limits_of_thesis()
    for load, verdict in ((0.0, 'passed'), (0.2, 'missed'), (nan, 'passed')):
        row = limit_rows(limits, limits, {}, {STAGE_2: load})[1]
        assert row['condition'] == STAGE_2.title and row['verdict'] == verdict


def test_interval_of_a_limit_holds_seeds_engine_and_constants():
    limit = Limit((9.0, 9.2))
    assert half_width(limit, limit, None) == limit.half_width
    assert half_width(limit, Limit((8.5, 8.5)), (9.0, 9.4)) == pytest.approx(
        hypot(limit.half_width, 0.6, 0.2)
    )
    limits = limits_of_thesis()
    away = limits | {STAGE_1: Limit((5.6, 5.6))}
    for others, spread, verdict in (
        (limits, {}, 'passed'),
        (away, {}, 'undecided'),
        (limits, {STAGE_1.title: (5.6, 7.2)}, 'undecided'),
    ):
        assert limit_rows(limits, others, spread, {})[0]['verdict'] == verdict


def test_order_holds_on_both_engines_and_is_undecided_where_seeds_leave_it_open():
    limits = limits_of_thesis()
    level = limits | {STAGE_3: limits[STAGE_2]}
    inverted = limits | {STAGE_3: Limit((6.0, 6.0))}
    for here, others, verdict in (
        (limits, limits, 'passed'),
        (limits, level, 'undecided'),
        (level, level, 'missed'),
        (limits, inverted, 'missed'),
        (inverted, limits, 'missed'),
    ):
        assert order_rows(here, others)[0]['verdict'] == verdict
    ankle = order_rows(limits | {walking(18.0): Limit((8.0, 8.0))}, limits)[2]
    assert 'K_A 12 and 18' in ankle['motion'] and ankle['verdict'] == 'missed'


@pytest.mark.parametrize(
    ('said', 'measured', 'difference'),
    [
        ({'slips': True}, walked(slip=0.002), 'does not slip: slides less than 3.0 mm'),
        ({'slips': False}, walked(slip=0.004), 'slips: slides 3.0 mm or more'),
        ({'vibrates': False}, walked(vibration=0.3), 'vibrates'),
        ({}, walked('fell'), 'does not stay up'),
        ({'survives': False}, walked(), 'stays up'),
        (
            {'survives': False, 'slid_first': True},
            walked('fell', slid_first=False),
            'tips without sliding before',
        ),
        ({'survives': None, 'dominated': True}, walked(), 'less power above 4 Hz than below'),
        ({'alike': True}, walked(early=0.2, late=0.8), 'cycles 3 and 4 are not alike'),
        ({'alike': True}, walked(early=None, late=None), 'cycles 3 and 4 are not alike'),
        (
            {'lines': ((8.0, 9.0),)},
            walked('walked', 2.6, 4.3, 0.9, 6.1, 8.5),
            '8.00 to 9.00 Hz not among the 4 largest',
        ),
        (
            {'lines': ((1.0, 2.0),), 'dominant': True},
            walked('walked', 4.3, 1.8),
            '1.00 to 2.00 Hz not the largest peak',
        ),
        ({'single': True}, walked('walked', 1.8, single=False), 'not the single dominant peak'),
        ({'lines': ((2.0, 3.0), (5.0, 6.0)), 'either': True}, walked('walked', 5.5), None),
        ({'gone': ((1.0, 2.0),)}, walked('walked', 7.8, 1.7), 'still a peak in 1.00 to 2.00 Hz'),
    ],
)
def test_walk_is_judged_by_the_statement_of_the_thesis(said, measured, difference):
    """What agrees with each statement passes on the board of the thesis itself."""
    row = walk_row(ThesisWalk(5.0, walking(), '', **said), walks(measured, measured), 3.0)
    assert row['differences'] == ([difference] if difference else [])
    assert row['verdict'] == ('missed' if difference else 'passed')


def test_walk_is_undecided_if_seeds_differ_and_never_slips_if_no_slide_is_known_to_be_one():
    again = next(row for row in WALKS if row.thesis == 'slips again')
    some_fall = walks(walked('slipped'), walked('fell'))
    assert walk_row(again, some_fall)['verdict'] == 'undecided'
    slipping = walks(*[walked(slip=0.004)] * 2)
    assert walk_row(again, slipping, nan)['verdict'] == 'missed'


class Walks(Thesis):
    """Walks with known slides by inclination; None for a lost walk."""

    def __init__(self, slides):
        super().__init__()
        self.slides = slides

    def walks(self, condition, phi):
        slide = self.slides[phi]
        return walks(*[walked('fell') if slide is None else walked(slip=slide)] * 2)


@pytest.mark.parametrize(
    ('slides', 'least', 'verdict'),
    [
        ((0.01, 0.012), 0.1, 'passed'),
        ((0.01, 0.0105), 0.1, 'missed'),
        ((0.01, 0.019), 1.0, 'missed'),
        ((0.01, None), 0.1, 'missed'),
    ],
)
def test_trend_grows_noticeably_at_the_inclinations_of_the_thesis(slides, least, verdict):
    trend = ThesisTrend('', '', 'slide', ((walking(), 1.0), (walking(), 2.0)), least)
    row = trend_row(trend, Walks(dict(zip((1.0, 2.0), slides, strict=True))))
    assert row['verdict'] == verdict
    assert row['lost'] == (['no control at 2 deg'] if slides[1] is None else [])


def test_slip_is_twice_the_slide_of_any_walk_without_slip():
    assert slips_from_mm(Walks({0.0: 0.001, 3.0: 0.005, 5.55: 0.002, 6.99: 0.001})) == 10.0
    assert slips_from_mm(Walks(dict.fromkeys((0.0, 3.0, 5.55, 6.99), 1e-4))) == VISIBLE_SLIDE_MM
    assert not isfinite(slips_from_mm(Walks({0.0: None, 3.0: 0.005, 5.55: 0.002, 6.99: 0.001})))


def test_one_seed_judges_nothing_that_varies_with_seeds():
    bench = Thesis()
    bench.seeds = 1
    board = scoreboard.compare(bench)
    assert {row['verdict'] for row in (*board.walks, *board.trends)} == {'undecided'}
    every = scoreboard_page.count(board.rows)
    assert summary(board).startswith(
        f'{every["undecided"]} of {every["judged"]} rows are undecided by one seed; '
    )
    assert QUICK in scoreboard_markdown(board)


def test_every_walk_of_the_thesis_has_a_scenario_to_run():
    walked = [path for path in shipped() if path.stem.startswith('walk')]
    ours = [Condition.of(load_scenario(str(path))) for path in walked]
    for row in WALKS:
        if row.survives and not row.condition.changes:
            assert (row.condition, row.inclination_deg) in ours


@pytest.mark.slow
def test_measurements_are_of_the_run():
    quick_walk = (
        (('gait', 'start_delay'), 0.0),
        (('gait', 'end_pause'), 0.0),
        (('gait', 'cycles'), 3),
        (('gait', 'cycle_period'), 1.9),
    )
    found = walk(Condition(changes=quick_walk), 0.0, 0)
    assert found['stayed_up'] and found['peaks_hz']
    assert all(0.5 / 1.9 < frequency < 15.5 for frequency in found['peaks_hz'])
    assert found['amplitude_rad_s'] > 0.0 and found['late'] is None and -1.0 <= found['early'] <= 1
    quick = ((('gait', 'hold_time'), 1.0), (('gait', 'end_pause'), 0.0))
    one = lift(Condition('leg_lift', changes=quick), 1.0, 0)
    assert one['stayed_up'] and one['inclination_deg'] == 1.0
    weight = 1.5 * 9.81
    assert one['toe_n'] + one['heel_n'] == pytest.approx(weight, rel=0.05)
    assert one['share'] == pytest.approx(one['difference_n'] / (one['toe_n'] + one['heel_n']))


@pytest.mark.slow
def test_robot_tips_on_one_leg_and_over_both_feet_if_it_lowers_the_foot_fast():
    slow = replace(STAGE_2, changes=with_engine('mujoco'))
    fast = replace(STAGE_2, changes=with_engine('mujoco', ((('gait', 'lower_time'), 1.0),)))
    tipped, setting_down = lift(slow, 8.5, 0), lift(fast, 7.2, 0)
    assert tipped['verdict'] == setting_down['verdict'] == 'fell'
    assert tipped['lifted_load'] < EMPTY_FOOT_MOST < setting_down['lifted_load']
    assert lift(slow, 7.2, 0)['stayed_up']


class Unlucky(Thesis):
    """A bench with seeds of different limits of standing, and a fall before forces are read."""

    def limit(self, condition, seeds=None):
        if condition != STAGE_1:
            return super().limit(condition, seeds)
        stood = [outcome(inclination_deg=deg, seed=seed) for seed, deg in enumerate((6.3, 6.5))]
        return Limit((6.4, 6.6), runs=run_table(stood))

    def lifts(self, condition, phi):
        found = super().lifts(condition, phi)
        return found.assign(difference_n=nan) if phi == STAGE_1_READ[-1] else found


def test_forces_are_read_where_every_seed_stands_and_a_fall_before_is_a_miss():
    rows = {row.get('name'): row for row in scoreboard.compare(Unlucky(), False).standing}
    for name in (f'{each} over the load of the support foot' for each in ('Delta', 'heel force')):
        assert rows[f"{name}, at stage 1's limit"]['inclinations_deg'] == [6.3]
    assert rows['largest error of phi read back from Delta']['verdict'] == 'missed'


def test_verdicts_are_counted_by_chapter(amiss):
    found = scoreboard_page.counts(amiss)
    assert [one['title'][:9] for one in found] == [f'Chapter {n}' for n in (3, 4, 5, 6)]
    assert [one['missed'] for one in found] == [0, 0, 1, 1], 'the limit, and its order'
    every = scoreboard_page.count(amiss.rows)
    for name in ('passed', 'missed', 'undecided', 'unpublished', 'judged'):
        assert sum(one[name] for one in found) == every[name]
    text = scoreboard_markdown(amiss)
    assert text.count('| **miss** |') == 2 and text.count('| pass |') == every['passed']
    fitted = [row for row in amiss.rows if row['kind'] == 'fitted']
    assert f'; {len(fitted) - 2} of {len(fitted)} fitted rows pass' in summary(amiss)
