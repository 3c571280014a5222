"""Which run a command means: the only one, the one of the domain that was named."""

import pytest

from khr_bringup.errors import BringupError
from khr_bringup.run_registry import choose, registered, running


@pytest.fixture(autouse=True)
def own_register(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)


def test_without_a_run_there_is_none_to_mean():
    with pytest.raises(BringupError, match='no run is going on; start one'):
        choose()


def test_the_only_run_is_meant_whatever_the_environment_says(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '42')
    with registered('walk', tmp_path) as only:
        assert choose() == only
        with pytest.raises(BringupError, match='in domain 42'):
            choose(42)
    assert not running()


def test_of_several_the_domain_tells_by_option_or_as_for_every_ros_tool(tmp_path, monkeypatch):
    with registered('walk', tmp_path) as first, registered('stand', tmp_path) as second:
        assert first.domain != second.domain
        with pytest.raises(BringupError, match=r'--domain or ROS_DOMAIN_ID: .*walk.*stand'):
            choose()
        assert choose(second.domain) == second
        monkeypatch.setenv('ROS_DOMAIN_ID', str(first.domain))
        assert choose() == first
        assert choose(second.domain) == second, 'the option is the nearer word'
