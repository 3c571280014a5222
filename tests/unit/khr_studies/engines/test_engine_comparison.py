"""What counts as a difference between the engines, and the page that says so."""

import json
from dataclasses import replace

import pytest

from khr_common import KhrError
from khr_sim.physics.engines import LIBRARIES
from khr_studies.engines import page as engines_page
from khr_studies.engines.study import (
    CAUSES,
    ENGINES,
    Cause,
    ChangedWalk,
    ComparedLimit,
    ComparedScenario,
    Comparison,
    Quantity,
    StudiedLimit,
    compare_engines,
    measure_scenario,
    with_engine,
)
from khr_studies.measuring.limit import Limit


def limit(*of_seeds):
    return Limit(of_seeds, ())


@pytest.mark.parametrize(
    ('first', 'second', 'inside'),
    [
        ((1.0, 1.2, 0.9), (1.1,), True),
        ((1.0, 1.2, 0.9), (1.3, 1.4), False),
        ((1.0,), (1.0,), True),
        ((2.0, 3.0), (1.0, 1.9), False),
    ],
)
def test_a_number_is_inside_where_the_ranges_overlap(first, second, inside):
    assert Quantity('x', (first, second)).is_inside == inside
    assert Quantity('x', (second, first)).is_inside == inside


@pytest.mark.parametrize(
    ('first', 'second', 'inside'),
    [
        (limit(7.8, 7.8), limit(7.85, 7.85), True),  # the edge of a limit is ragged
        (limit(7.8, 7.8), limit(8.2, 8.2), False),
        (limit(7.6, 8.0), limit(8.1, 8.1), True),  # its seeds scatter
    ],
)
def test_a_limit_is_inside_within_its_interval_and_the_ragged_edge(first, second, inside):
    assert ComparedLimit('walk', (first, second)).is_inside == inside
    assert ComparedLimit('walk', (second, first)).is_inside == inside


def test_a_change_explains_what_brings_one_engine_to_the_other():
    compared = ComparedLimit('walk', (limit(7.8, 7.8), limit(7.0, 7.0)))
    causes = (
        Cause('mujoco', 'contact time 2 ms', limit(7.8, 7.8), 0.8),
        Cause('mujoco', 'friction 0.25', limit(7.2, 7.2), 0.2),
        Cause('bullet', 'friction 0.23', limit(7.05, 7.05), -0.75),
        Cause('bullet', 'step 0.5 ms', limit(7.8, 7.8), 0.0),
    )
    assert StudiedLimit(compared, causes).explanations == (
        'mujoco with contact time 2 ms',
        'bullet with friction 0.23',
    )


def test_the_engines_compared_are_those_there_are():
    assert ENGINES == tuple(LIBRARIES) == tuple(CAUSES)


@pytest.mark.parametrize('engine', ENGINES)
def test_the_forces_of_a_standing_robot_are_its_weight(engine):
    found = measure_scenario('stand_0deg', with_engine(engine))
    assert found.verdict == 'stood'
    assert found.numbers['toes, N'] + found.numbers['heels, N'] == pytest.approx(14.71, rel=2e-3)


def comparison():
    compared = ComparedLimit('walk, K_A 12', (limit(7.8, 7.8), limit(7.0, 7.0)))
    return Comparison(
        2,
        0.1,
        (
            ComparedScenario(
                'walk_0deg',
                (('walked',) * 4, ('fell',) * 4),
                (Quantity('distance, m', ((0.5, 0.6), (0.7, 0.8))),),
            ),
        ),
        (compared,),
        (StudiedLimit(compared, (Cause('mujoco', 'friction 0.25', limit(7.2, 7.2), 0.2),)),),
        (ChangedWalk('mujoco', 'friction 0.25', {'distance, m': 0.51}),),
    )


def test_the_page_names_each_difference_and_what_stays_open(tmp_path):
    out = tmp_path / 'docs' / 'engines.md'
    summary = engines_page.write(comparison(), out)
    assert summary == '0 of 1 scenarios share a verdict, 0 of 1 limits agree'
    text = out.read_text()
    assert '| walk_0deg | verdict | walked | fell | **outside** |' in text
    assert '|  | distance, m | 0.5 | 0.7 | **outside** |' in text
    assert '| walk, K_A 12 | 7.80 +- 0.20 | 7.00 +- 0.20 | -0.80 | 0.28 | **outside** |' in text
    assert 'open' in text
    assert summary in text
    data = json.loads(out.with_suffix('.json').read_text())
    assert data['limits'][0]['limits'][1]['of_seeds'] == [7.0, 7.0]
    agreed = replace(comparison(), limits=(), studied=())
    assert 'open' not in engines_page.page(agreed)


@pytest.mark.parametrize(('seeds', 'only'), [(1, None), (2, 'walk_nowhere')])
def test_mistakes_are_named_before_anything_starts(seeds, only):
    with pytest.raises(KhrError, match=r'accepted'):
        compare_engines(seeds, 0.1, 1, only)
