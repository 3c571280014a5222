"""Without PyBullet a scenario that names no engine runs on MuJoCo; one that names it is refused."""

import pytest

from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.scenario import Scenario, with_installed_engine
from khr_common.errors import KhrError
from khr_sim.physics import engines
from khr_sim.run_parameters import RunParameters


def test_without_pybullet_mujoco_is_the_engine(monkeypatch, capsys):
    monkeypatch.setattr(scenarios, '_installed', lambda _: False)
    scenarios._name_the_engine.cache_clear()  # another test of this process may have let it say so
    chosen = with_installed_engine(Scenario('plain', {}))
    assert chosen.table(RunParameters).engine == 'mujoco'
    assert '"make bullet" compiles PyBullet' in capsys.readouterr().err


def test_a_stated_engine_stays(monkeypatch):
    monkeypatch.setattr(scenarios, '_installed', lambda _: False)
    stated = Scenario('stated', {'simulator': {'engine': 'bullet'}})
    assert with_installed_engine(stated) is stated


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_an_engine_that_is_not_installed_is_one_line(monkeypatch, engine):
    monkeypatch.setattr(engines, 'find_spec', lambda _: None)
    scenario = Scenario('short', {'simulator': {'engine': engine, 'duration': 0.1}})
    with pytest.raises(
        KhrError, match=f"engine: '{engine}' is not installed; accepted: "
    ) as error:
        run_offline(scenario)
    assert '\n' not in str(error.value)
