"""Differences between the engines that count, and the page that shows them."""

import pytest

from khr_common import KhrError
from khr_sim.physics.engines import LIBRARIES
from khr_studies.engines import page as engines_page
from khr_studies.engines.study import (
    CAUSES,
    ENGINES,
    LIMITS,
    STUDIED,
    UNCHANGED,
    WALK,
    causes_of,
    compare,
    compare_engines,
    compared_limits,
    limit_of_seed,
    measure_scenario,
    with_engine,
)
from khr_studies.measuring.run_table import read_table, run_table
from tests import ROOT
from tests.fakes.jobs import HerePool

FIRST, SECOND = ENGINES


def limits(engine, of_seeds, change=UNCHANGED):
    return [
        {
            'part': 'limit',
            'condition': 'walk',
            'engine': engine,
            'change': change,
            'seed': seed,
            'limit_deg': limit_deg,
            'tolerance_deg': 0.0,
        }
        for seed, limit_deg in enumerate(of_seeds)
    ]


@pytest.mark.parametrize(
    ('first', 'second', 'inside'),
    [
        ((7.8, 7.8), (7.85, 7.85), True),  # the boundary of a limit is ragged
        ((7.8, 7.8), (8.2, 8.2), False),
        ((7.6, 8.0), (8.1, 8.1), True),  # its seeds scatter
    ],
)
def test_a_limit_is_inside_within_both_intervals(first, second, inside):
    for one, other in ((first, second), (second, first)):
        (row,) = compared_limits(run_table([*limits(FIRST, one), *limits(SECOND, other)])).to_dict(
            'records'
        )
        assert row['inside'] == inside
        assert row['difference'] == pytest.approx(sum(other) / 2 - sum(one) / 2)


def test_a_change_explains_a_difference_if_it_brings_one_engine_to_the_other():
    runs = run_table(
        [
            *limits('bullet', (7.8, 7.8)),
            *limits('mujoco', (7.0, 7.0)),
            *limits('mujoco', (7.8, 7.8), 'contact time 2 ms'),
            *limits('mujoco', (7.2, 7.2), 'friction 0.25'),
            *limits('bullet', (7.05, 7.05), 'friction 0.23'),
            *limits('bullet', (7.8, 7.8), 'step 0.5 ms'),
        ]
    )
    (limit,) = compared_limits(runs).to_dict('records')
    found = causes_of(runs, limit)
    assert found['moved'].tolist() == pytest.approx([0.8, 0.2, -0.75, 0.0])
    assert found['explains'].tolist() == [True, False, True, False]


def test_the_page_is_that_of_its_runs():
    shipped = (ROOT / 'docs' / 'engines.md').read_text(encoding='utf-8')
    rendered = engines_page.page(read_table(ROOT / 'docs' / 'engines.csv'))
    assert rendered.partition('\n## ')[2] == shipped.partition('\n## ')[2], 'below the versions'


def test_the_engines_compared_are_those_there_are():
    assert tuple(LIBRARIES) == ENGINES == tuple(CAUSES)


@pytest.mark.parametrize('engine', ENGINES)
def test_the_forces_of_a_standing_robot_are_its_weight(engine):
    found = measure_scenario('stand_0deg', with_engine(engine))
    assert found['verdict'] == 'stood'
    assert found['toes_n'] + found['heels_n'] == pytest.approx(14.71, rel=2e-3)


class Invented(HerePool):
    """Measures what was invented: limits differ between engines for the studied walk alone."""

    def submit(self, function, *arguments):
        invented = limit_of if function is limit_of_seed else values_of
        return super().submit(invented, *arguments)


def limit_of(condition, seed, start, tolerance):
    apart = condition.engine == SECOND and condition.title == STUDIED.title
    return [{**condition.columns(start, seed), 'limit_deg': 7.0 if apart else 7.8}]


def values_of(name, changes):
    engine = dict(changes)['simulator', 'engine']
    return {'verdict': 'walked' if engine == FIRST else 'fell', 'distance_m': 0.5}


def test_the_page_and_the_table_hold_each_difference(tmp_path):
    runs = compare(Invented(), [WALK], 2, 0.1)
    out = tmp_path / 'docs' / 'engines.md'
    summary = engines_page.write(runs, out)
    assert (
        summary
        == f'0 of 1 scenarios share a verdict, {len(LIMITS) - 1} of {len(LIMITS)} limits agree'
    )
    text = out.read_text()
    assert summary in text and f'### {STUDIED.title}' in text and text.count('### ') == 1
    assert 'open' in text and text.count('| **outside** |') == 2
    assert engines_page.page(read_table(out.with_suffix('.csv'))) == text


@pytest.mark.parametrize(('seeds', 'only'), [(1, None), (2, 'walk_nowhere')])
def test_mistakes_are_named_before_anything_starts(seeds, only):
    with pytest.raises(KhrError, match=r'accepted'):
        compare_engines(seeds, 0.1, 1, only)
