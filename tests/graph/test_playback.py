"""Recorded runs in a real browser."""

import re
import signal
from contextlib import suppress

import pytest
from playwright.sync_api import TimeoutError

from tests.support.browser import browser_page, free_port, row
from tests.support.runs import khr, start_khr, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


@pytest.fixture(scope='module')
def walked(tmp_path_factory):
    folder = tmp_path_factory.mktemp('playback') / 'walked'
    assert khr('run', 'walk_8.88deg_ka12', '--out', folder).code == 0
    return folder


@pytest.fixture(scope='module')
def fallen(tmp_path_factory):
    folder = tmp_path_factory.mktemp('playback') / 'fallen'
    change = 'ankle_controller.enabled=false'
    assert khr('run', 'walk_8.88deg_ka12', '--set', change, '--out', folder).code == 0
    return folder


@pytest.fixture
def played():
    """Play runs back, and end with Ctrl-C, well."""
    processes = []

    def play(*arguments):
        port = free_port()
        processes.append(start_khr('view', *arguments, '--no-browser', '--port', port))
        assert f':{port}/' in processes[-1].stderr.readline()
        return f'http://127.0.0.1:{port}/'

    yield play
    for process in processes:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
        assert process.returncode == 0, err


def shown_time(page):
    return float(page.locator('.khr td').nth(1).inner_text().removesuffix(' s'))


def test_it_seeks_steps_and_finds_the_fall(fallen, played):
    with browser_page() as (page, _):
        page.goto(played(fallen))
        page.get_by_text('forward', exact=True).click()  # a single step pauses
        page.get_by_role('button', name='Play', exact=True).wait_for()
        slider = row(page, 'Time, s', 'input').locator('input[type=text]').first

        def seek():
            """Type a time; that of the step may still arrive amid the typing, and replace it."""
            slider.fill('1.2')
            slider.press('Enter')
            with suppress(TimeoutError):
                page.wait_for_function(
                    "document.querySelectorAll('.khr td')[1].innerText == '1.20 s'", timeout=10_000
                )
                return True

        wait_for(seek, 'the time typed')
        page.get_by_text('forward', exact=True).click()
        page.wait_for_function("document.querySelectorAll('.khr td')[1].innerText != '1.20 s'")
        assert shown_time(page) == pytest.approx(1.215, abs=0.006)
        row(page, 'Go to', 'input').locator('input').first.click()
        page.get_by_role('option', name=re.compile('fell')).click()
        page.get_by_text('fell at').wait_for()
        assert shown_time(page) > 1.5


def test_two_runs_stand_side_by_side(walked, played):
    with browser_page() as (page, _):
        page.goto(played(walked, '--against', walked))
        page.get_by_text('walked | walked').wait_for()
        page.wait_for_function("document.querySelectorAll('.khr tr')[0].children.length == 3")


def test_a_cut_bag_is_shown_up_to_the_cut(walked, played, tmp_path):
    cut = tmp_path / 'cut.mcap'
    (whole,) = (walked / 'bag').glob('*.mcap')
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with browser_page() as (page, _):
        page.goto(played(cut))
        page.get_by_text('not a readable bag').wait_for()


@pytest.mark.parametrize('content', [None, b'', b'no bag'])
def test_what_is_no_bag_is_one_line(tmp_path, content):
    if content is not None:
        (tmp_path / 'run.mcap').write_bytes(content)
    done = khr('view', tmp_path if content is None else tmp_path / 'run.mcap')
    assert done.code == 2
    assert len(done.err.strip().splitlines()) == 1 and 'accepted' in done.err
