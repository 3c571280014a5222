"""Settings of all tests."""

import gc
import os
import signal
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

from khr_common.arithmetic import PORTABLE, enter, in_force
from tests import ROOT

pytest.register_assert_rewrite('tests.support')

if Path.cwd() != ROOT:  # colcon tests in a package's folder; processes of tests find them too
    os.environ['PYTHONPATH'] = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])

# Times are for benchmarks: on a busy machine a property that holds may be slow. And a failure is
# to be one of the change at hand, so the examples are the same in every run;
# ``pytest --hypothesis-profile search`` looks for new ones; make nightly takes the most.
settings.register_profile('nightly', deadline=None, derandomize=True, max_examples=100)
settings.register_profile('khr', settings.get_profile('nightly'), max_examples=30)
settings.register_profile('quick', settings.get_profile('nightly'), max_examples=20)
settings.register_profile('search', deadline=None)
settings.load_profile('khr')


# Tests of many processes at once: a busy machine may keep one waiting beyond its time. What fails
# there is tried again, twice at most; pytest counts it as rerun.
OF_PROCESSES = ('graph', 'reliability', 'integration', 'installation')
# Tests that keep up with the wall clock, most of them with a browser: two files of them at once may
# be too much for two cores.
OF_REAL_TIME = (
    'graph/test_board.py',
    'graph/test_driver.py',
    'graph/test_live.py',
    'graph/test_page*.py',
    'graph/test_playback.py',
    'integration/test_narrow_pages.py',
)
OF_MILLISECONDS = ('khr_hardware/test_server.py',)  # on a pseudo-terminal


def pytest_configure(config):
    if in_force() != PORTABLE:  # restart, with the terminal's own output
        if capture := config.pluginmanager.getplugin('capturemanager'):
            capture.stop_global_capturing()
        enter()
    from tests.support.process_signals import hand_on_signals  # its asserts are rewritten by now

    hand_on_signals()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Begin with the files that take longest, so that none of them is left alone at the end.

    Those are the files whose tests are given the most time, then those with the most slow tests.
    Of three files that follow one another at most one keeps up with the wall clock.
    """
    patience, slow = {}, Counter()
    by_day = 'not nightly' in config.option.markexpr
    again = config.pluginmanager.hasplugin('rerunfailures')  # not under colcon
    for item in items:
        alike = not set(OF_PROCESSES).isdisjoint(item.path.relative_to(ROOT).parts)
        alike = alike or item.path.match(*OF_MILLISECONDS)
        if again and alike:
            item.add_marker(pytest.mark.flaky(reruns=2))
        if by_day and item.get_closest_marker('nightly'):
            continue
        mark = item.get_closest_marker('timeout')
        patience[item.path] = max(patience.get(item.path, 0.0), mark.args[0] if mark else 0.0)
        slow[item.path] += item.get_closest_marker('slow') is not None
    files = sorted(
        dict.fromkeys(item.path for item in items),
        key=lambda path: (-patience.get(path, 0.0), -slow[path]),
    )
    keeping_up = [path for path in files if any(path.match(each) for each in OF_REAL_TIME)]
    place = {path: 3 * number for number, path in enumerate(keeping_up)}
    others = (path for path in files if path not in place)
    place |= {path: number + number // 2 + 1 for number, path in enumerate(others)}
    items.sort(key=lambda item: (place[item.path], str(item.path)))
    gc.freeze()  # what is collected and imported stays: the collector need not look there again


@pytest.fixture
def in_background():
    """Start runs that a test does not wait for; none is left behind."""
    from tests.support.runs import start_khr  # few tests need it and what it imports

    processes = []

    def start(*arguments):
        processes.append(start_khr(*arguments))
        return processes[-1]

    yield start
    for process in processes:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=30)
