"""The bouts of the study, their comparison, the criterion and the page."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from khr.cli.app import app
from khr_bringup.bout.bout import load_bout
from khr_common.errors import KhrError
from khr_studies.fights import study as fights
from khr_studies.fights.page import page
from khr_studies.fights.study import (
    CHECKED,
    DUEL,
    PLAN,
    SHOVE,
    Fight,
    compared,
    counted,
    fight_once,
    judged,
    verdict,
)
from khr_studies.measuring.run_table import newcombe, read_table, write_table

DOCS = Path(__file__).parents[4] / 'docs'


@pytest.mark.parametrize(
    ('counts', 'expected'),
    [  # table II of Newcombe (1998), method 10
        ((56, 70, 48, 80), (0.2, 0.0524, 0.3339)),
        ((0, 10, 0, 20), (0.0, -0.1611, 0.2775)),
    ],
)
def test_the_interval_of_a_difference_is_that_of_its_author(counts, expected):
    assert newcombe(*counts) == pytest.approx(expected, abs=2e-4)


def test_all_fights_of_a_seed_have_the_same_draws_within_their_range():
    for seed in (1, 2):
        starts = set()
        for fight in (*PLAN, *CHECKED):
            bout, own = load_bout(fight.bout), fight.bout_of(seed)
            for before, after, back in zip(
                (bout.rules.red_start, bout.rules.blue_start),
                (own.rules.red_start, own.rules.blue_start),
                (-1.0, 1.0),
                strict=True,
            ):
                assert 0.0 <= back * (after[0] - before[0]) <= 0.01 + 1e-9
                assert abs(after[1] - before[1]) <= 0.01 and abs(after[2] - before[2]) <= 5.0
            starts.add((fight.bout, own.rules.red_start, own.rules.blue_start))
            assert own.rules.rounds == 1 and own.engine == fight.engine
        assert len(starts) == 3  # one of each bout
    first, second = (Fight(SHOVE, 12.0, 12.0, 'stand').settings(seed) for seed in (1, 2))
    assert first != second


def test_a_fight_differs_from_its_bout_by_its_gains_stance_and_recovery():
    robots = Fight(SHOVE, 18.0, 0.0, 'guard').bout_of(1).robots
    assert robots['red'].of('ankle_controller')['gain'] == 18.0
    assert robots['blue'].of('ankle_controller')['enabled'] is False
    assert robots['blue'].of('gait')['motion'] == 'guard'
    assert 'recovery' not in robots['blue'].nodes
    stepping = Fight(SHOVE, 12.0, 12.0, 'stand', recovery=True).bout_of(1).robots
    assert 'recovery' in stepping['blue'].nodes and 'recovery' not in stepping['red'].nodes
    delays = [
        each.of('gait')['start_delay'] for each in Fight(DUEL, 0, 0).bout_of(1).robots.values()
    ]
    assert len(set(delays)) == 2 and all(1.0 <= delay <= 3.0 for delay in delays)


@pytest.mark.parametrize(
    ('effects', 'expected'),
    [
        (('better', 'better', 'none'), 'wins'),
        (('worse', 'worse', 'better'), 'loses'),
        (('both', 'both', 'better'), 'neither'),
    ],
)
def test_the_verdict_needs_more_than_half_of_the_fights(effects, expected):
    assert verdict([{'effect': each} for each in effects]) == expected


def test_the_page_is_that_of_its_bouts_and_a_bout_repeats():
    table = read_table(DOCS / 'fights.csv')
    assert page(table, 'fights') == (DOCS / 'fights.md').read_text(encoding='utf-8')
    assert len(judged(compared(counted(table)))) == 15
    row = table[(table['bout'] == DUEL) & (table['engine'] == 'mujoco')].iloc[4]
    again = fight_once(Fight(DUEL, row['red_ka'], row['blue_ka']).bout_of(int(row['seed'])))
    assert again == {name: row[name] if row.notna()[name] else None for name in again}


def test_the_page_counts_the_bouts_that_were_fought():
    table = read_table(DOCS / 'fights.csv')
    assert '- 3 bouts a cell on MuJoCo, 3 a cell on' in page(table[table['seed'] <= 3], 'few')


@pytest.mark.slow
def test_the_command_writes_the_page_of_measured_bouts(tmp_path, monkeypatch):
    monkeypatch.setattr(fights, 'PLAN', ())  # no bout may be fought
    write_table(read_table(DOCS / 'fights.csv'), tmp_path / 'own.csv')
    done = CliRunner().invoke(app(), ['fights', '--measured', '--out', str(tmp_path / 'own.md')])
    assert done.exit_code == 0, done.output
    assert 'fights: in ' in done.output
    assert (tmp_path / 'own.png').stat().st_size > 10_000
    missing = CliRunner().invoke(app(), ['fights', '--measured', '--out', str(tmp_path / 'no.md')])
    assert isinstance(missing.exception, KhrError)
