"""Every control of a live page in a real browser: a short walk that restarts, then stays."""

import re
import signal

import pytest
import yaml

from khr_view.controls import tunables
from tests.support.browser import browser_page, choose, labels, said, slider, viewed_run
from tests.support.runs import Bag, finish, interrupt, khr, wait_for, wait_until_running

pytestmark = [pytest.mark.nightly, pytest.mark.timeout(300)]
SHORT = ('walk_0deg', '--pace', 4, '--set', 'gait.cycles=1')
OF_LOCKSTEP = [each for each in tunables() if each.name != 'realtime_factor']


@pytest.fixture(scope='module')
def viewed(tmp_path_factory):
    others = ('--set', 'roll_controller.enabled=true', '--set', 'recovery.enabled=true')
    with viewed_run(tmp_path_factory.mktemp('controls') / 'run', *SHORT, *others) as process:
        yield process


@pytest.fixture(scope='module')
def page(viewed):
    with browser_page() as (page, _):
        page.goto(f'http://127.0.0.1:{viewed.port}/')
        slider(page, 'Roll gain').wait_for()
        yield page


def value(viewed, node, name):
    """Return a parameter as ``khr get`` says."""
    shown = khr('get', node, name, '--domain', viewed.domain)
    return yaml.safe_load(shown.out)[name] if shown.code == 0 else None


def test_a_walk_that_has_ended_restarts(page, viewed):
    said(page, r'^Loading ')
    said(page, r'^walking, [\d.]+ of 6\.\d s$')
    said(page, '^finished, walked: restarts$')
    said(page, '^restarting$')
    wait_for(viewed.folder.with_name('run-2').is_dir, 'the next run')
    said(page, r'^walking, ', since='^finished')


def test_it_restarts_with_the_next_seed_or_stays(page, viewed):
    choose(page, 'At the end', 'restart, next seed')
    said(page, '^finished, walked: restarts, next seed$')
    wait_for(lambda: value(viewed, 'simulator', 'seed') == 1, 'the next seed')
    choose(page, 'At the end', 'stay')
    said(page, '^finished, walked: press Restart$')


@pytest.mark.parametrize('tunable', OF_LOCKSTEP, ids=lambda each: f'{each.node}.{each.name}')
def test_a_control_changes_its_parameter(page, viewed, tunable):
    if tunable.name == 'enabled':
        box = page.get_by_role('checkbox', name=tunable.label)
        wanted = not box.is_checked()
        box.set_checked(wanted)
        wait_for(lambda: value(viewed, *tunable.key) is wanted, tunable.label)
        box.set_checked(not wanted)
        return
    (label,) = (each for each in labels(page) if each.startswith(tunable.label))
    thumb = slider(page, label)
    before = float(thumb.get_attribute('aria-valuenow'))
    thumb.press('ArrowRight')
    thumb.press('ArrowRight')
    wanted = pytest.approx(before + 2 * tunable.step)
    wait_for(lambda: value(viewed, *tunable.key) == wanted, label)
    thumb.press('ArrowLeft')
    thumb.press('ArrowLeft')


def depth_of_controls(page):
    """Return how far the first slider is below the state of the run, px."""
    page.locator('.khr-state').wait_for()
    place = '(sought) => document.querySelector(sought)?.getBoundingClientRect().y'
    return page.evaluate(f'({place})("[role=slider]") - ({place})(".khr-state")')


def test_a_push_to_the_left_with_all_force_fells_it_and_a_restart_raises_it(page):
    before = depth_of_controls(page)
    choose(page, 'Direction', 'to its left')
    slider(page, 'Force, N').press('End')
    page.get_by_role('button', name='Push', exact=True).click()
    said(page, r'^fell at [\d.]+ s: press Restart$')
    page.get_by_role('button', name='Restart').click()
    said(page, '^walking, ', since='^fell')
    page.locator('.khr-attempts td', has_text=re.compile('^fell$')).wait_for()
    assert depth_of_controls(page) == before, 'neither fall nor restart moves them'


def test_another_scenario_takes_the_place_of_the_one_that_runs(page, viewed):
    choose(page, 'Scenario', 'stand_0deg')
    page.get_by_role('button', name='Switch').click()
    said(page, '^standing, ')
    page.get_by_role('cell', name=re.compile('Standing')).wait_for()
    assert value(viewed, 'gait', 'motion') == 'stand'


def test_the_push_is_in_the_bag(viewed):
    """Last of this run: it ends it."""
    assert interrupt(viewed, signal.SIGINT).code == 0
    forces = [
        message.wrench.force
        for folder in viewed.folder.parent.glob('run*/bag')
        for _, message in Bag(folder)['/simulator/push']
    ]
    assert [(force.x, force.y) for force in forces] == [(0.0, 30.0)]


def test_in_realtime_its_speed_is_set(page, in_background, tmp_path):
    folder = tmp_path / 'run'
    process = in_background(
        'run', 'stand_0deg', '--realtime', '--duration', 600, '--view', '--out', folder
    )
    line = wait_for(
        lambda: re.search(r'page: (http://\S+)', process.stderr.readline()), 'the address'
    )
    process.domain = wait_until_running(folder)
    page.goto(line[1])
    slider(page, 'Speed, times real time').press('ArrowRight')
    wanted = pytest.approx(1.05)
    wait_for(lambda: value(process, 'simulator', 'realtime_factor') == wanted, 'the speed')
    process.send_signal(signal.SIGINT)
    ended = finish(process, folder)
    assert ended.code == 130, ended.err
    page.get_by_text(re.compile('^khr has ended: ')).wait_for()
