"""Recorded runs in a real browser."""

import re
import signal
from contextlib import suppress

import pytest
from playwright.sync_api import TimeoutError

from khr_view.charts.charts import charts
from tests.support.browser import (
    browser_page,
    chart,
    choose,
    free_port,
    labels,
    row,
    saved,
    slider,
)
from tests.support.in_process import khr_here
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


STATUS = '.khr:has(.khr-state) td'  # not those of the spectrum's table


def shown_time(page):
    return float(page.locator(STATUS).nth(1).inner_text().removesuffix(' s'))


def comes(page, seconds):
    """Return whether a time is shown within 10 s."""
    shown = f"parseFloat(document.querySelectorAll('{STATUS}')[1].innerText)"
    with suppress(TimeoutError):
        page.wait_for_function(f'Math.abs({shown} - {seconds}) < 0.006', timeout=10_000)
        return True


def test_every_control_of_a_recording_acts_and_a_cut_bag_is_shown_up_to_the_cut(
    fallen, played, tmp_path
):
    cut = tmp_path / 'cut.mcap'
    (whole,) = (fallen / 'bag').glob('*.mcap')
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with browser_page() as (page, _):
        page.goto(played(fallen))
        page.locator('.khr-state').wait_for()
        page.get_by_text('Choose', exact=True).click()
        page.get_by_role('checkbox', name='Net slip so far').check()
        chart(page, 'Net slip so far').wait_for()
        assert set(labels(page)) == {each.title for each in charts()} - {'Recovery, estimated'} | {
            'Time, s', 'Step', 'Speed, times real time', 'Begin again at the end', 'Go to',
            'Spectrum', 'Forces and balance', 'See through the robot', 'Follow the robot', 'Dark',
        }  # fmt: skip
        page.get_by_role('button', name='Pause', exact=True).click()
        page.get_by_role('button', name='Play', exact=True).wait_for()
        slider(page, 'Time, s').press('Home')
        wait_for(lambda: shown_time(page) == 0.0, 'the start')
        for periods in (1, 2):

            def step(time=0.015 * periods):
                """Press a key: one that comes before the answer to the last one is lost."""
                slider(page, 'Time, s').press('ArrowRight')
                return comes(page, time)

            wait_for(step, f'{periods} periods')
        page.get_by_text('back', exact=True).click()
        wait_for(lambda: shown_time(page) == pytest.approx(0.015, abs=0.006), 'a step back')
        page.get_by_role('checkbox', name='Begin again at the end').uncheck()
        choose(page, 'Speed, times real time', '5')
        page.get_by_role('button', name='Play', exact=True).click()
        page.get_by_role('button', name='Pause', exact=True).wait_for()
        # It stops there by itself, and plays on from the start.
        page.get_by_role('button', name='Play', exact=True).wait_for()
        end = shown_time(page)
        page.get_by_role('button', name='Play', exact=True).click()
        wait_for(lambda: shown_time(page) < end, 'the start')
        page.get_by_role('checkbox', name='Begin again at the end').check()
        wait_for(lambda: shown_time(page) == end, 'the end')
        wait_for(lambda: shown_time(page) < end, 'the start by itself')
        name, table = saved(page, 'Signals as CSV')
        assert name == 'signals.csv' and table.startswith(b'"time, s"')
        row(page, 'Go to', 'input').locator('input').first.click()
        page.get_by_role('option', name=re.compile('fell')).click()
        page.get_by_text('fell at').wait_for()
        page.get_by_role('checkbox', name='Dark').check()
        page.locator('html[data-mantine-color-scheme=dark]').wait_for()
        page.goto(played(cut))
        page.get_by_text('not a readable bag').wait_for()


@pytest.mark.nightly
def test_two_runs_stand_side_by_side(walked, fallen, played):
    with browser_page() as (page, _):
        page.goto(played(walked, '--against', fallen))
        page.get_by_text('walked | fallen').wait_for()
        page.wait_for_function("document.querySelectorAll('.khr tr')[0].children.length == 3")
        slider(page, 'Time, s').press('End')
        for title in ('Spectrum of the pitch rate of walked', 'Foot forces'):
            chart(page, title).wait_for()
        page.get_by_text('Spectrum of the pitch rate of fallen: its recording').wait_for()
        heading = page.locator('[data-khr-title]').get_attribute('data-khr-title')
        walk = 'Walking downhill at 8.88 deg on the smooth surface'
        assert re.match(
            rf'walked: {walk}, K_A 12, at 13.\d\d s\nfallen: {walk}, no control, at 3.\d\d s$',
            heading,
        )
        lines = chart(page, 'Foot forces').locator('.u-legend .u-label').all_inner_texts()
        assert lines[1:3] == ['left toe, walked', 'left heel, walked (dashed)']
        assert 'right heel, fallen (dash-dotted)' in lines


@pytest.mark.parametrize('content', [None, b'', b'no bag'])
def test_what_is_no_bag_is_one_line(tmp_path, content):
    if content is not None:
        (tmp_path / 'run.mcap').write_bytes(content)
    done = khr_here('view', tmp_path if content is None else tmp_path / 'run.mcap')
    assert done.code == 2
    assert len(done.err.strip().splitlines()) == 1 and 'accepted' in done.err
