"""The example's driver and its relatives, where ROS 2 finds executables."""

import pytest

from tests.support.drivers import install_example
from tests.support.runs import khr


@pytest.fixture(scope='package')
def with_example(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        for name, value in install_example(tmp_path_factory.mktemp('prefix')).items():
            patch.setenv(name, value)
        yield


@pytest.fixture(scope='package')
def stand_on(with_example, tmp_path_factory):
    """Return a function that has the robot of a driver stand, with its ankles controlled."""

    def run(driver, *arguments):
        folder = tmp_path_factory.mktemp('driven') / 'run'
        ended = khr(
            *('run', 'stand_0deg', '--driver', driver, '--duration', 3, '--out', folder),
            *('--set', 'ankle_controller.enabled=true', '--expect', 'upright', *arguments),
            folder=folder,
        )
        assert ended.code == 0, ended.err
        return ended

    return run
