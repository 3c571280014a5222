"""The successive runs of a page, where the reader's changes hold, and the thread of the page."""

import pytest

from khr_bringup.scenario.scenario import load_scenario, read_scenario
from khr_common.errors import KhrError
from khr_view.session import Session
from khr_view.viewing import in_thread
from tests import ROOT


@pytest.fixture
def session():
    chosen = load_scenario('walk_8.88deg_ka12')
    return Session(chosen.changed({('simulator', 'pace'): 1.0, ('simulator', 'duration'): 0.0}))


def test_a_restart_keeps_all_changes_and_names_them(session):
    first = session.scenario
    session.keep('ankle_controller', 'gain', 18.0)
    session.keep('simulator', 'inclination_deg', 5.0)
    session.keep('simulator', 'pace', 1.0)  # as it was
    session.restart()
    assert session.advance() and session.next is None
    assert session.scenario.of('ankle_controller')['gain'] == 18.0
    assert session.scenario.of('simulator')['inclination_deg'] == 5.0
    kept, _, _ = first.title.partition(', ankle gain')
    assert session.scenario.title == f'{kept}, K_A 18 (gyro), simulator.inclination_deg=5'
    session.restart()
    assert session.next.title == session.scenario.title and not session.next.driver


def test_a_change_between_two_runs_holds_in_the_next_one(session):
    session.restart()
    session.keep('ankle_controller', 'gain', 18.0)
    session.keep('roll_controller', 'gain', 3.0)  # which does not take part
    session.advance()
    assert session.scenario.of('ankle_controller')['gain'] == 18.0


def test_the_next_seed_is_that_of_every_node(session):
    for seed in (1, 2):
        session.next_seed()
        session.advance()
        for node in ('simulator', 'gyro', 'foot_force'):
            assert session.scenario.of(node)['seed'] == seed


def test_another_scenario_keeps_gains_and_speed_alone(session):
    session.keep('ankle_controller', 'gain', 18.0)
    session.keep('roll_controller', 'gain', 3.0)  # which does not take part there
    session.keep('simulator', 'inclination_deg', 5.0)
    session.keep('simulator', 'pace', 2.0)
    session.switch('walk_6.99deg_ka12')
    chosen = session.next
    assert (chosen.name, chosen.of('ankle_controller')['gain']) == ('walk_6.99deg_ka12', 18.0)
    assert chosen.of('simulator')['inclination_deg'] == 6.99
    assert chosen.of('simulator')['pace'] == 2.0
    assert chosen.title.endswith('surface, K_A 18 (gyro), simulator.pace=2')


def test_another_scenario_without_an_engine_keeps_that_of_the_session(session):
    stated = '/**/simulator: {ros__parameters: {engine: bullet}}'
    mujoco = Session(session.scenario.changed({('simulator', 'engine'): 'mujoco'}))
    for name, text, engine in (('walk_6.99deg_ka12', None, 'mujoco'), ('own', stated, 'bullet')):
        mujoco.switch(name, text)
        assert mujoco.next.of('simulator')['engine'] == engine


def test_a_motion_file_lies_beside_its_scenario(session, tmp_path, monkeypatch):
    squat = ROOT / 'examples' / 'squat.yaml'
    monkeypatch.chdir(tmp_path)
    session.switch(str(squat))
    by_path = session.next.values
    session.switch('squat', read_scenario(squat).stated_to_yaml())  # as khr switch sends it
    assert session.next.values == by_path and by_path['gait']['frames']


def test_a_refused_scenario_changes_nothing(session):
    with pytest.raises(KhrError):
        session.switch('mine', '/**/gait: {ros__parameters: {stride: 1.0e+9}}')
    assert session.next is None and not session.advance()


def test_no_run_follows_an_interruption(session):
    session.restart()
    session.end()
    assert not session.advance()


def test_an_error_in_the_thread_of_the_page_is_reported_and_the_run_goes_on():
    lines = []
    with in_thread(lambda _: 1 / 0, lines.append):
        lines.append('the run')
    assert sorted(lines) == [
        'khr: the page has stopped: ZeroDivisionError: division by zero',
        'the run',
    ]


def test_the_page_is_asked_to_stop_at_the_end_of_its_run():
    stopped = []
    with in_thread(lambda stop: stopped.append(stop.wait(30.0)), print):
        assert not stopped
    assert stopped == [True]
