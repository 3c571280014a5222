"""The recovery study: its levels, bounds and page, and the search for the shape of the step."""

from contextlib import nullcontext
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from khr.cli.app import app
from khr_balance.gaits.kinematics import GaitError
from khr_balance.recovery.parameters import RecoveryParameters
from khr_bringup.scenario.scenario import parse
from khr_common.errors import KhrError
from khr_studies.measuring.run_table import read_table
from khr_studies.push.study import START
from khr_studies.recovery import search as searching
from khr_studies.recovery.page import page, pushes_held
from khr_studies.recovery.search import RANGES, Search, attempt, search, write
from khr_studies.recovery.study import CASES, bounds, held, push_once, quiet_scenarios, quiet_walks
from tests.fakes.jobs import HerePool

DOCS = Path(__file__).parents[4] / 'docs'


def runs(*falls):
    """Return runs at levels 1, 2, ..., each with the falls of its seeds."""
    rows = [(level, fell) for level, seeds in enumerate(falls, 1) for fell in seeds]
    return pd.DataFrame(rows, columns=['level', 'fell'])


@pytest.mark.parametrize(
    ('falls', 'expected'),
    [
        ([[False], [False], [True]], (2.0, [])),
        ([[False], [True], [False], [True]], (1.0, [2.0])),  # a hole
        ([[False, False], [False, True]], (1.0, [])),  # one seed falls
        ([[True], [True]], (0.0, [])),
        ([[False], [False]], (2.0, [])),
    ],
)
def test_the_largest_push_is_below_every_fall_and_holes_are_named(falls, expected):
    assert held(runs(*falls), 'level') == expected


@pytest.mark.parametrize('case', CASES[:4], ids=str)
def test_a_step_is_worth_more_than_a_flywheel_and_less_than_endless_steps(case):
    own = bounds(case)
    assert own['planted'] < own['flywheel'] < own['step'] < own['steps']


def test_an_oblique_push_has_the_size_and_direction_that_is_asked():
    condition = CASES[0].condition('mujoco')
    straight = push_once(condition, 0.5)
    assert push_once(condition, 0.5, 0.0) == straight
    assert not straight['fell']
    assert push_once(condition, 0.5, 90.0) != straight


def test_the_page_is_that_of_its_runs():
    table = read_table(DOCS / 'recovery.csv')
    shipped = page(table, 'recovery')
    assert shipped == (DOCS / 'recovery.md').read_text()
    assert ('Missed:' in shipped) == ('**miss**' in shipped)
    assert {row['engine'] for row in pushes_held(table)} == {'bullet', 'mujoco'}


def test_the_page_names_each_missed_goal():
    table = read_table(DOCS / 'recovery.csv')
    table.loc[
        (table['part'] == 'step') & (table['case'] == 1) & (table['times'] > 1.0), 'fell'
    ] = True
    text = page(table, 'recovery')
    missed = [row for row in pushes_held(table) if row['robot'] == 0 and not row['met']]
    assert {row['engine'] for row in missed} == {'bullet', 'mujoco'}
    for row in missed:
        assert f'{row["push"]}, {row["slope"]} deg, {row["engine"]}: {row["times"]:.1f} of' in text


def test_a_job_holds_all_of_its_scenario(tmp_path, monkeypatch):
    """A kept result of a scenario in the current folder is not one of its changed file."""
    own = tmp_path / 'config/scenarios/walk_0deg.yaml'
    own.parent.mkdir(parents=True)
    monkeypatch.chdir(tmp_path)

    def jobs(cycles):
        own.write_text(f'/**/gait:\n  ros__parameters: {{motion: walk, cycles: {cycles}}}\n')
        return [job for plan in (quiet_scenarios(), quiet_walks()) for _, job in plan]

    before, after = jobs(2), jobs(3)
    changed = [one[0].name for one, other in zip(before, after, strict=True) if one != other]
    assert len(changed) == 1 + len(quiet_walks()) and set(changed) == {'walk_0deg'}


# ---- the search ----


@pytest.fixture
def pushed(monkeypatch):
    """Pushes that topple a robot by its step length alone; their impulses, one per run."""
    impulses = []

    def attempt(condition, impulse) -> dict:
        impulses.append(impulse)
        length = dict(condition.changes)['recovery', 'step_length'][1]
        fell = impulse > 10.0 * length
        return {'fell': fell, 'fell_at_s': START + 1.0 if fell else None}

    def limit_of_ankles(condition) -> dict:
        return {'held': 1.0}

    monkeypatch.setattr(
        'khr_studies.measuring.kept_pool.local_pool', lambda *_: nullcontext(HerePool())
    )
    monkeypatch.setattr(searching, 'attempt', attempt)
    monkeypatch.setattr(searching, 'limit_of_ankles', limit_of_ankles)
    return impulses


def test_a_search_improves_on_the_default_and_resumes(pushed, tmp_path):
    asked = Search('front', 32)
    found = search(asked, 1, tmp_path)
    assert found.before < found.held <= found.pushes
    assert dict(zip(RANGES, found.values, strict=True))['step_length'] > 0.0672
    runs = len(pushed)
    assert search(asked, 1, tmp_path) == found
    assert len(pushed) == runs


def test_the_file_holds_what_was_found_and_the_default_of_the_other_direction(tmp_path):
    values = [low for low, _ in RANGES.values()]
    text = write([searching.Found(Search('front'), values, 3, 2, 27)], tmp_path)
    assert text.splitlines()[0] == 'front: 3 of 27 pushes held, 2 by the default'
    path = tmp_path / 'recovery.yaml'
    read = parse(path.read_text(), str(path), 'recovery').table(RecoveryParameters)
    for name, (low, _) in RANGES.items():
        assert getattr(read, name) == (getattr(RecoveryParameters(), name)[0], low)


def test_the_default_step_is_within_the_ranges_searched():
    for name, (low, high) in RANGES.items():
        assert all(low <= value <= high for value in getattr(RecoveryParameters(), name)), name


def test_a_step_out_of_reach_counts_as_a_fall(monkeypatch):
    def refuse(*_):
        raise GaitError('left leg: too short')

    monkeypatch.setattr(searching, 'push_once', refuse)
    assert attempt(Search('front'), 1.0)['fell']


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        (['--search'], '--search: not accepted without --recovery'),
        (['--recovery', '--search', '--measured'], '--measured: not accepted with --search'),
        (['--recovery', '--search', '--seeds', '3'], '--seeds: not accepted with --search'),
        (['--recovery', '--candidates', '50'], '--candidates: not accepted without'),
        (['--recovery', '--search', '--ka', '18'], '--recovery: has pushes of its own'),
        (['--recovery', '--search', '--direction', 'left'], "--direction: 'left'"),
        (['--recovery', '--search', '--candidates', '3'], '--candidates: 3 is not accepted'),
    ],
)
def test_options_that_do_not_go_together_are_refused(options, message, tmp_path):
    done = CliRunner().invoke(app(), ['push', *options, '--out', str(tmp_path)])
    assert isinstance(done.exception, KhrError)
    assert str(done.exception).startswith(message)
    assert not [*tmp_path.iterdir()]
