"""A run on the example's driver while it goes on: watched and changed."""

import json
import re

import pytest

from tests.support.browser import browser_page, slider
from tests.support.drivers import PENDULUM
from tests.support.runs import LONG, interrupt, khr, start_khr, wait_for, wait_until_running

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]


@pytest.fixture(scope='module')
def live(with_example, tmp_path_factory):
    """A run on show; its last test ends it."""
    folder = tmp_path_factory.mktemp('live') / 'run'
    process = start_khr(
        'run', 'stand_0deg', '--driver', PENDULUM, *LONG, '--view', '--out', folder
    )
    line = wait_for(
        lambda: re.search(r'page: (http://127.0.0.1:\d+/)', process.stderr.readline()), 'address'
    )
    process.folder, process.page = folder, line[1]
    process.domain = ('--domain', wait_until_running(folder))
    yield process
    if process.poll() is None:
        interrupt(process)


def test_the_page_offers_what_the_driver_does_and_says_what_it_does_not(live):
    with browser_page() as (page, _):
        page.goto(live.page)
        page.get_by_text('the driver does not know the pose').first.wait_for()
        push = page.get_by_role('button', name='No push: the driver takes none')
        pause = page.get_by_role('button', name='No pause: the driver has none')
        wait_for(lambda: page.wait_for_timeout(50) or push.is_disabled(), 'the push')
        assert pause.is_disabled()
        assert not page.get_by_role('button', name='Restart').count(), 'a run has no successor'
        assert slider(page, 'Ankle gain K_A').is_visible()


def test_parameters_are_read_and_set(live):
    changed = khr('set', 'ankle_controller', 'gain', '7', *live.domain)
    assert changed.code == 0, changed.err
    shown = khr('get', 'ankle_controller', 'gain', *live.domain)
    assert 'gain: 7.0' in shown.out


def test_the_change_is_in_the_outcome(live):
    """Last in the module: it ends the run."""
    ended = interrupt(live)
    assert ended.code == 130, ended.err
    outcome = json.loads((live.folder / 'outcome.json').read_text())
    assert outcome['judged_by'] == 'sensors'
    assert [each['value'] for each in outcome['changes']] == [7.0]
