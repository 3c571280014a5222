"""The page of live runs, in a real browser that finds no host but this one."""

import csv
import io
import json
import re
import signal
from math import hypot

import numpy as np
import pytest
import rclpy
import yaml
from geometry_msgs.msg import WrenchStamped
from PIL import Image
from rclpy.executors import SingleThreadedExecutor
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from khr_bringup.graph.run_registry import running
from khr_bringup.scenario.scenario import load_scenario
from khr_common.interfaces import PUSHED
from tests.support.browser import browser_page, chart, row, saved, slider, viewed_run
from tests.support.in_process import khr_here
from tests.support.runs import Bag, interrupt, joined, khr, wait_for, wait_until_running

WALKING, STANDING = (re.compile(rf'^{word}, [\d.]+ ') for word in ('walking', 'standing'))
DRAWN = 'window.__viserTestpoints.uplots'  # viser's own, for tests
SIZE = 'chart => [chart.width, chart.ctx.canvas.width]'
POINTS = 'chart => chart.data[0].length'
VERMILION = (213, 94, 0)
DELTA = 'Delta, toes less heels'
TITLES = ('Spectrum', 'Pitch rate', 'Foot forces', 'Delta', 'Corrections')
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


@pytest.fixture(scope='module')
def viewed(tmp_path_factory):
    """A long walk on show, and the folders of the runs that follow it."""
    folder = tmp_path_factory.mktemp('page') / 'run'
    with viewed_run(folder, 'walk_3deg', '--set', 'gait.cycles=80') as process:
        process.second, process.third = (folder.with_name(f'run-{number}') for number in (2, 3))
        yield process


@pytest.fixture(scope='module')
def page(viewed):
    with browser_page() as (page, asked):
        page.asked = asked
        page.goto(f'http://127.0.0.1:{viewed.port}/')
        slider(page, 'Ankle gain K_A').wait_for()
        yield page


# ---- while the robot walks ----


def test_the_page_asks_nobody_else_and_names_what_runs(page, viewed):
    page.get_by_text(WALKING).wait_for()
    assert row(page, 'Scenario', 'input').locator('input').first.input_value() == 'walk_3deg'
    hosts = {
        re.match(r'\w+://([^/]*)', url)[1] for url in page.asked if url[:4] in ('http', 'ws:/')
    }
    assert hosts == {f'127.0.0.1:{viewed.port}'}


@pytest.mark.parametrize(
    ('origin', 'host'),
    [
        ('http://evil.example', None),
        ('http://evil.example:{port}', None),
        (None, None),
        ('http://evil.example:{port}', 'evil.example:{port}'),
    ],
)
def test_a_foreign_page_cannot_open_the_socket(viewed, origin, host):
    headers = {'Host': host.format(port=viewed.port)} if host else {}
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(
            f'ws://127.0.0.1:{viewed.port}',
            origin=origin.format(port=viewed.port) if origin else None,
            additional_headers=headers,
            subprotocols=['viser-v1.1.1'],
        ),
    ):
        pass
    assert refused.value.response.status_code == 403


def gain(viewed):
    shown = khr_here('get', 'ankle_controller', 'gain', '--domain', viewed.domain)
    return yaml.safe_load(shown.out)['gain'] if shown.code == 0 else None


def test_a_slider_changes_the_parameter_of_the_node_and_follows_one_that_is_set(page, viewed):
    thumb = slider(page, 'Ankle gain K_A')
    thumb.focus()
    for _ in range(4):
        page.keyboard.press('ArrowRight')
    assert thumb.get_attribute('aria-valuenow') == '14'
    wait_for(lambda: gain(viewed) == 14.0, 'the gain')
    assert khr_here('set', 'hip_controller', 'gain', '20', '--domain', viewed.domain).code == 0
    hip = slider(page, 'Hip gain K_H')
    wait_for(
        lambda: page.wait_for_timeout(50) or hip.get_attribute('aria-valuenow') == '20',
        'the slider',
    )


def test_a_number_acts_on_enter_alone_and_out_of_range_is_refused_as_by_the_command(page, viewed):
    """However many digits it has: viser's number box takes a longer one for a typing error."""
    thumb, before = slider(page, 'Ankle gain K_A'), '14'
    box = row(page, 'Ankle gain K_A', 'input').locator('input').last
    for number, after in (('99', before), ('23', '23')):
        box.focus()
        box.press('Control+a')
        box.type(number)
        page.wait_for_timeout(500)
        assert thumb.get_attribute('aria-valuenow') == before
        box.press('Enter')
        wait_for(lambda wanted=after: thumb.get_attribute('aria-valuenow') == wanted, number)
        if after == before:
            words = 'ankle_controller: gain: 99.0 is not accepted; accepted: float in [0, 60]'
            page.get_by_text(words).wait_for()
    wait_for(lambda: gain(viewed) == 23.0, 'the gain')
    state = page.locator('.khr-state').inner_text()
    wait_for(lambda: page.locator('.khr-state').inner_text() != state, 'a page that goes on')


# ---- charts, and how the page looks, while the walk is halted ----


@pytest.fixture(scope='module')
def halted(page):
    """Return the page once the first spectrum has come and the run is halted.

    Every chart has points then: once halted, none gets more. A walk that begins again has no
    spectrum at first, and may do so before a slow browser halts it.
    """
    page.set_viewport_size({'width': 1400, 'height': 850})
    page.get_by_text(re.compile('^line n = ')).first.wait_for()

    def all_have_points():
        return all((drawn(page, title, POINTS) or 0) > 10 for title in TITLES)

    while True:
        wait_for(all_have_points, 'points of all charts')
        page.get_by_role('button', name='Pause').click()
        page.get_by_text(re.compile('^paused at')).wait_for()
        if all_have_points():
            return page
        page.get_by_role('button', name='Go on').click()
        page.get_by_text(re.compile('^paused at')).wait_for(state='hidden')


def drawn(page, title, what):
    """Return what JavaScript says of the uPlot chart whose title begins like this."""
    return page.evaluate(
        f"""title => {{
            const found = Object.values({DRAWN}).map((each) => each.chart)
                .find((each) => each.title.textContent.startsWith(title));
            return found && (({what})(found));
        }}""".replace('each.title.textContent', "each.root.querySelector('.u-title').textContent"),
        title,
    )


def choose(page, label, shown):
    """Show or hide a chart by its checkbox, among those that are folded away at first."""
    box = page.get_by_role('checkbox', name=label, exact=True)
    if not box.is_visible():
        page.get_by_text('Choose', exact=True).click()
    box.set_checked(shown)


def test_every_chart_has_ticks_units_and_a_scale_though_some_of_its_lines_have_no_data(halted):
    """No node publishes a correction of the roll controller, and there is no earlier attempt."""
    for title in TITLES:
        for axis in (0, 1):

            def ticks(title=title, axis=axis):
                found = drawn(halted, title, f'chart => chart.axes[{axis}]._values') or []
                return len([text for text in found if text]) >= 3

            wait_for(ticks, f'three ticks on axis {axis} of {title}')
        assert re.search('deg/s|N|deg', chart(halted, title).locator('.u-title').inner_text())
    scales = f'Object.values({DRAWN}).map(({{chart}}) => [chart.scales.y.min, chart.scales.y.max])'
    assert all(None not in ends and ends[0] < ends[1] for ends in halted.evaluate(scales))
    ends = drawn(halted, 'Corrections', 'chart => [chart.scales.y.min, chart.scales.y.max]')
    assert ends == [0, 1], 'no controller acts in this walk: a chart of zeros'


RESIZE = """async chart => {
    const {width, height} = chart;
    const drawn = () => new Promise((done) => setTimeout(done, 100));
    chart.setSize({width: 0, height});
    await drawn();
    chart.setSize({width, height});
    chart.setData(chart.data, false);
    chart.redraw();
    await drawn();
    return chart.axes[0]._found[1];
}"""
RESCALE = """async chart => {
    const {min, max} = chart.scales.x;
    const middle = (min + max) / 2;
    const range = async (max) => {
        chart.setScale('x', {min, max});
        chart.redraw();
        await new Promise((done) => setTimeout(done, 100));
        return chart.scales.x.max;
    };
    const found = await range(middle);
    await range(max);
    return found / middle;
}"""


def test_ticks_and_range_are_kept_when_size_and_data_come_at_once(halted):
    assert drawn(halted, 'Pitch rate', RESIZE) > 0
    assert drawn(halted, 'Spectrum', RESCALE) == pytest.approx(1.0)


def test_the_cursor_shows_the_values_of_one_time_in_all_charts(halted):
    chart(halted, 'Foot forces').locator('.u-over').hover()

    def legend(title):
        """Return the values by label; there is no attempt before the first one."""
        of = chart(halted, title).locator('.u-legend')
        labels, values = (
            of.locator(f'.u-{part}').all_inner_texts() for part in ('label', 'value')
        )
        return dict(zip(labels, values, strict=True)) | {'attempt before': '0'}

    of_forces, of_rate = legend('Foot forces'), legend('Pitch rate')
    assert len(of_forces) == 9 and len(of_rate) == 7
    assert of_forces['s'] == of_rate['s']
    assert all(
        re.fullmatch(r'-?[\d.,]+', text) for text in (*of_forces.values(), *of_rate.values())
    )


def test_a_reader_chooses_the_charts_and_saves_what_is_chosen(halted):
    choose(halted, 'Joint ankle pitch', True)
    choose(halted, DELTA, False)
    chart(halted, 'Joint ankle pitch').wait_for()
    chart(halted, DELTA).wait_for(state='detached')
    samples = drawn(halted, 'Joint ankle pitch', 'chart => chart.data[1].length')

    def columns():
        name, table = saved(halted, 'Signals as CSV')
        assert name == 'signals.csv'
        return list(csv.reader(io.StringIO(table.decode())))

    table = wait_for(lambda: len((found := columns())[0]) == 21 and found, 'chosen columns')
    head, *rows = table
    assert head[0] == 'time, s' and 'Joint ankle pitch left, deg' in head
    assert not any(name.startswith(DELTA) for name in head)
    assert len(rows) == pytest.approx(samples, abs=10), (
        'the newest of one have come, of another not'
    )
    times = np.array([float(line[0]) for line in rows])
    assert np.diff(times) == pytest.approx(0.015)
    choose(halted, DELTA, True)


def test_the_spectrum_is_saved_with_its_peaks_named_in_the_page(halted):
    name, table = saved(halted, 'Spectrum as CSV')
    assert name == 'spectrum.csv'
    head, *rows = csv.reader(io.StringIO(table.decode()))
    assert head == ['frequency, Hz', 'pitch rate, deg/s']
    largest = max(float(amplitude) for _, amplitude in rows)
    assert largest > 1.0
    peaks = re.compile(r'^(line n = \d+|off the lines, n = [\d.]+)$')
    assert halted.get_by_text(peaks).count() > 1


def test_the_charts_are_saved_as_they_are_shown_at_the_size_of_a_slide(halted):
    def sizes():
        return [drawn(halted, title, SIZE) for title in TITLES]

    wait_for(lambda: all(width for width, _ in sizes()), 'all charts')
    before = sizes()
    name, content = saved(halted, 'Charts as PNG')
    assert name == 'charts.png'
    picture = Image.open(io.BytesIO(content)).convert('RGB')
    count = halted.locator('.uplot:visible').count()
    assert picture.width > 1400 and picture.height > 400 * (count // 2)
    assert pixels(picture, VERMILION) > 500, 'the right foot'
    heading = halted.locator('[data-khr-title]').get_attribute('data-khr-title')
    assert re.match(r'Walking downhill at 3 deg.*, no control, at [\d.]+ s$', heading), heading
    assert pixels(picture.crop((0, 0, picture.width, 60)), (0, 0, 0)) > 500, 'the heading'
    assert sizes() == before, 'the charts of the page are as before'


def test_forces_and_support_can_be_hidden(halted):
    """The robot stands still meanwhile: nothing else changes in the picture."""
    box = halted.get_by_role('checkbox', name='Forces and balance')
    shown = middle_of(halted)
    box.uncheck()
    wait_for(lambda: changed(shown, middle_of(halted)) > 100, 'a robot without them')
    box.check()


def test_keyboard_alone_reaches_every_control(halted):
    numbered = 0
    for role in ('slider', 'checkbox', 'button', 'textbox', 'combobox'):
        numbered = halted.get_by_role(role).evaluate_all(
            '(all, first) => all.reduce((n, each) => (each.dataset.number = n) + 1, first)',
            numbered,
        )
    assert numbered > 20
    missed = set(range(numbered))
    for _ in range(3 * numbered):
        if missed:
            halted.keyboard.press('Tab')
            missed.discard(int(halted.evaluate('document.activeElement.dataset.number ?? -1')))
    assert not missed


def changed(before, now):
    """Count the pixels that are of another colour than before."""
    return int((np.abs(np.asarray(before, int) - np.asarray(now, int)).max(axis=2) > 40).sum())


def pixels(picture, color, tolerance=40):
    far = np.abs(np.asarray(picture, dtype=int) - color).max(axis=2)
    return int((far <= tolerance).sum())


def middle_of(page):
    clip = {'x': 370, 'y': 0, 'width': 680, 'height': 850}
    return Image.open(io.BytesIO(page.screenshot(clip=clip))).convert('RGB')


# ---- the runs that follow: each has a folder of its own ----


def test_another_scenario_takes_the_place_of_the_walk_and_a_refused_one_does_not(
    page, viewed, tmp_path
):
    scenario = tmp_path / 'other.yaml'
    scenario.write_text('/**/gait:\n  ros__parameters:\n    stride: 1.0e+9\n')
    refused = khr_here('switch', scenario, '--domain', viewed.domain)
    assert refused.code == 2 and 'stride' in refused.err
    assert viewed.poll() is None and not viewed.second.exists()
    switched = khr_here('switch', 'stand_0deg', '--domain', viewed.domain)
    assert switched.code == 0 and 'walk_3deg' in switched.out, switched.err
    assert wait_until_running(viewed.second) == viewed.domain
    (entry,) = (each for each in running() if each.folder == str(viewed.second))
    assert entry.scenario == 'stand_0deg'
    page.get_by_text(STANDING).wait_for()
    page.get_by_role('cell', name=re.compile('^Standing on the flat')).wait_for()


def test_a_push_by_button_moves_the_robot_pause_halts_it_and_restart_runs_it_again(page, viewed):
    page.set_viewport_size({'width': 1000, 'height': 500})  # a small picture is drawn sooner
    page.get_by_role('button', name='Pause').click()
    page.get_by_text(re.compile('^paused at')).wait_for()
    page.get_by_role('button', name='Push', exact=True).click()
    page.get_by_role('button', name='Go on').click()
    page.get_by_text(STANDING).wait_for()
    page.get_by_role('button', name='Restart').click()
    wait_until_running(viewed.third)
    page.get_by_text(STANDING).wait_for()
    assert slider(page, 'Ankle gain K_A').get_attribute('aria-valuenow') == '23'
    assert gain(viewed) == 23.0


def test_a_drag_of_the_torso_pushes_it(page, viewed):
    """One may be lost that begins while the page is drawn anew; the bag is looked at later."""
    with joined(viewed.third) as node:
        executor = SingleThreadedExecutor(context=node.context)
        pushed = rclpy.Future(executor=executor)
        node.create_subscription(WrenchStamped, PUSHED.name, pushed.set_result, 10)
        for _ in range(10):
            drag(page)
            rclpy.spin_until_future_complete(node, pushed, executor=executor, timeout_sec=3.0)
            if pushed.done():
                return
    pytest.fail('no drag of ten pushed the robot')


def drag(page):
    page.mouse.move(520, 205)
    page.mouse.down()
    for far in range(16, 104, 16):
        for _ in range(3):  # the page takes a drag picture by picture
            page.evaluate('new Promise(requestAnimationFrame)')
        page.mouse.move(520 + far, 205)
    page.mouse.up()


@pytest.mark.nightly
def test_a_phone_shows_the_robot_above_the_controls_and_signals_first(page, viewed):
    phone = page.context.browser.new_page(viewport={'width': 390, 'height': 800})
    phone.goto(f'http://127.0.0.1:{viewed.port}/')
    pause = phone.get_by_role('button', name='Pause')
    pause.wait_for()
    assert phone.get_by_text('khr', exact=True).first.bounding_box()['y'] > 0.36 * 800
    assert pause.bounding_box()['width'] > 350
    signals = phone.get_by_role('button', name=re.compile('panel Signals'))
    assert signals.bounding_box()['y'] < pause.bounding_box()['y']
    signals.click()
    chart(phone, 'Spectrum').wait_for()
    wait_for(lambda: chart(phone, 'Spectrum').bounding_box()['y'] < 500, 'the spectrum')
    box = chart(phone, 'Spectrum').bounding_box()
    assert box['x'] >= 0 and box['x'] + box['width'] <= 390
    assert phone.evaluate('document.documentElement.scrollWidth') <= 390
    phone.close()


def test_a_taken_port_is_one_line(viewed, tmp_path):
    done = khr('view', 'stand_0deg', '--port', viewed.port, '--out', tmp_path / 'run')
    assert done.code == 2
    assert f'--port: {viewed.port} on 127.0.0.1' in done.err.splitlines()[-1]
    assert 'Traceback' not in done.err


def test_all_that_was_done_is_in_the_bags_and_is_repeated(page, viewed):
    """Last in the module: it ends the run."""
    ended = interrupt(viewed, signal.SIGINT)
    assert ended.code == 0, ended.err
    outcomes = [
        json.loads((folder / 'outcome.json').read_text())
        for folder in (viewed.folder, viewed.second, viewed.third)
    ]
    assert [each['scenario'] for each in outcomes] == ['walk_3deg', 'stand_0deg', 'stand_0deg']
    gains = [
        each['value']
        for each in outcomes[0]['changes']
        if each['parameter'] == 'ankle_controller.gain'
    ]
    assert 14.0 in gains and gains[-1] == 23.0
    for folder in (viewed.second, viewed.third):
        verified = khr_here('verify', folder)
        assert verified.out.splitlines()[-1] == 'same', verified.out
        kept = load_scenario(str(folder / 'scenario.yaml')).of('ankle_controller')
        assert kept['gain'] == 23.0, 'the gain is kept'
    bag = Bag(viewed.second / 'bag')
    ((_, push),) = bag['/simulator/push']
    assert push.wrench.force.x == 5.0
    pushed = push.header.stamp.sec + push.header.stamp.nanosec / 1e9
    rates = [
        (time / 1e9, message.angular_velocity.y) for time, message in bag['/ground_truth/imu']
    ]
    before = max(abs(rate) for time, rate in rates if pushed - 0.5 < time <= pushed)
    after = max(abs(rate) for time, rate in rates if pushed < time < pushed + 0.3)
    assert after > 10 * before
    (_, dragged), *_ = Bag(viewed.third / 'bag')['/simulator/push']
    assert hypot(dragged.wrench.force.x, dragged.wrench.force.y) > 1.0
