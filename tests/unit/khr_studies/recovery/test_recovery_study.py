"""Levels, holes, bounds and the page of the recovery study."""

from pathlib import Path

import pandas as pd
import pytest

from khr_studies.measuring.run_table import read_table
from khr_studies.recovery.page import page, pushes_held
from khr_studies.recovery.study import CASES, bounds, held, push_once

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
