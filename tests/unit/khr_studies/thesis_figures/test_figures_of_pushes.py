"""Figures of pushes, whose robot is simulated: their CSV files hold the numbers of the runs."""

import pytest

from khr_report.plots.plot_style import styled
from khr_studies.push.study import PushCondition, stance
from khr_studies.thesis_figures.registry import FIGURES
from tests.support.figures import PANELS, check_with_units, curve, rows_of

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def pushed(tmp_path_factory):
    """Draw the figures of pushes, whose robot is simulated, by the quicker engine; return rows."""
    found = {}
    with styled():
        for number in ('4.8', '4.10', '4.11', '4.12'):
            figure = FIGURES[number].draw(engine='mujoco')
            check_with_units(figure)
            assert len(figure.axes) == PANELS[number]
            found[number] = rows_of(figure, tmp_path_factory.mktemp('figure'))
    return found


def test_a_larger_push_tips_robot_and_model_faster(pushed):
    for panel in {where for where, *_ in pushed['4.8']}:
        forces = sorted(
            {what for where, what, *_ in pushed['4.8'] if where == panel},
            key=lambda name: float(name.split()[2]),
        )
        early = []
        for force in forces:
            time, rate = curve(pushed['4.8'], force, panel)
            early.append(rate[(time > 0.02) & (time < 0.1)].mean())
        assert len(early) == 5 and early == sorted(early)


def test_the_robot_is_pushed_on_the_engine_that_is_asked_for(pushed, tmp_path):
    with styled():
        rows = rows_of(FIGURES['4.8'].draw(), tmp_path)
    for panel, same in (("thesis's model, physical", True), ('simulated robot', False)):
        own, other = ([row for row in each if row[0] == panel] for each in (pushed['4.8'], rows))
        assert own and (own == other) == same


def test_pushes_from_both_sides_go_both_ways_with_and_without_control(pushed):
    rows = pushed['4.12']
    for panel in ('model, φ = 0°', 'model, φ = 2°', 'simulated robot'):
        names = {what for where, what, *_ in rows if panel in where and 'fell' not in what}
        assert len(names) == 4 and sum('no control' in name for name in names) == 2
        for name in names:
            time, ahead = curve(rows, name, panel)
            sign = 1.0 if 'behind' in name else -1.0
            assert sign * (ahead[(time > 0.05) & (time < 0.15)].mean() - ahead[0]) > 1.0
    middle = 1e3 * stance(PushCondition(gain=12.0).base()).ahead
    for side in ('behind', 'the front'):
        (name,) = {w for p, w, *_ in rows if 'simulated' in p and w.endswith(f'from {side}')}
        assert curve(rows, name, 'simulated robot')[1][0] == pytest.approx(middle, abs=4.0)


def test_what_control_does_to_the_model_is_seen_by_who_falls(pushed):
    def fallen(number, panel):
        return {what for where, what, *_ in pushed[number] if panel in where and 'fell' in what}

    for panel in ('model, φ = 0°', 'model, φ = 2°'):
        assert all('no control' in name for name in fallen('4.12', panel))
    assert len(fallen('4.12', 'model, φ = 0°')) == 2
    assert [name.split(', ')[1] for name in fallen('4.10', 'physical')] == ['K_A = 0: fell']
    assert {name.split(', ')[1] for name in fallen('4.10', 'as published')} == {
        'K_A = 0: fell',
        'K_A = 12: fell',
    }
