"""Restart and another scenario while a page stays open: each is a run with a folder of its own."""

import json
import signal

import pytest

from khr_bringup.graph.run_registry import running
from khr_bringup.recorded.bags import read_messages
from khr_bringup.scenario.scenario import load_scenario, parse
from khr_common.interfaces import SCENARIO
from tests.support.browser import viewed_run, viewer
from tests.support.in_process import khr_here
from tests.support.runs import finish, wait_for, wait_until_running

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
OTHER = 'lift_2.7deg'


@pytest.fixture
def viewed(tmp_path):
    with viewed_run(tmp_path / 'run', 'stand_0deg') as process:
        yield process


def test_each_scenario_is_a_run_of_its_own_that_verifies_and_a_refused_one_is_none(
    viewed, tmp_path
):
    scenario, following = tmp_path / 'other.yaml', tmp_path / 'run-2'
    scenario.write_text('/**/gait:\n  ros__parameters:\n    stride: 1.0e+9\n')
    refused = khr_here('switch', scenario, '--domain', viewed.domain)
    assert refused.code == 2 and 'stride' in refused.err
    assert viewed.poll() is None and not following.exists()
    with viewer(viewed.port) as got:
        wait_for(lambda: sum(got) > 10_000, 'the page')
        changed = khr_here('set', 'ankle_controller', 'gain', '7', '--domain', viewed.domain)
        assert changed.code == 0, changed.err
        switched = khr_here('switch', OTHER, '--domain', viewed.domain)
        assert switched.code == 0 and 'stand_0deg' in switched.out, switched.err
        assert wait_until_running(following) == viewed.domain
        (entry,) = (each for each in running() if each.folder == str(following))
        assert entry.scenario == OTHER
        before = sum(got)
        wait_for(lambda: sum(got) > before + 10_000, 'the page of the next run')
    viewed.send_signal(signal.SIGINT)
    ended = finish(viewed, viewed.folder)
    assert ended.code == 0, ended.err
    for folder, name, motion in (
        (viewed.folder, 'stand_0deg', 'stand'),
        (following, OTHER, load_scenario(OTHER).values['gait']['motion']),
    ):
        verified = khr_here('verify', folder)
        assert (verified.code, verified.out.splitlines()[-1]) == (0, 'same'), verified.out
        assert json.loads((folder / 'outcome.json').read_text())['scenario'] == name
        (text,) = read_messages(folder, [SCENARIO])[SCENARIO]
        assert f'motion: {motion}' in text.data
    assert load_scenario(OTHER).of('ankle_controller').get('gain') != 7.0
    kept = parse(text.data, 'the bag', OTHER).of('ankle_controller')
    assert kept['gain'] == 7.0, 'the gain is kept'
