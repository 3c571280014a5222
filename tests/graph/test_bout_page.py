"""A bout on the live page, in a real browser."""

import signal

import pytest

from tests.support.browser import browser_page, free_port, slider
from tests.support.runs import khr, start_khr, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def test_the_page_shows_both_robots_and_sets_the_gain_of_one(tmp_path):
    port = free_port()
    longer = ('--set', 'simulator.engine=mujoco', '--set', 'referee.time_limit=600.0')
    where = ('--no-browser', '--port', port, '--out', tmp_path / 'bout')
    viewed = start_khr('view', 'shove_guard', *longer, *where)
    try:
        next(line for line in viewed.stderr if 'page: http' in line)
        with browser_page() as (page, _):
            page.goto(f'http://127.0.0.1:{port}/')
            for robot in ('red', 'blue'):
                page.get_by_role('tab', name=robot).click()
                page.get_by_text(f'Spectrum of the pitch rate of {robot}').first.wait_for()
            gains = slider(page, 'Ankle gain K_A')
            wait_for(lambda: gains.count() == 2, 'the controls of both robots')
            cells = page.locator('.khr:has(.khr-state) td')
            wait_for(lambda: 'stood' in cells.all_inner_texts(), 'the verdict')
            assert cells.all_inner_texts()[:3] == ['', 'red', 'blue']
            gains.last.press('ArrowRight')  # blue's: 12 to 12.5
            wait_for(lambda: value('blue', tmp_path) == '12.5', 'the gain of blue')
            assert value('red', tmp_path) == '12.0'
    finally:
        viewed.send_signal(signal.SIGINT)
        _, err = viewed.communicate(timeout=60)
    assert viewed.returncode == 0, err
    assert 'Traceback' not in err and 'the page has stopped' not in err


def value(robot, folder):
    shown = khr('get', f'{robot}/ankle_controller', 'gain', folder=folder)
    return shown.out.partition('gain: ')[2].split('  #')[0].strip()
