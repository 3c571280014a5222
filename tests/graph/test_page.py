"""The page of a live run, in a real browser that finds no host but this one."""

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

from khr_bringup.scenario.scenario import load_scenario
from khr_common.interfaces import PUSHED
from tests.support.browser import browser_page, chart, row, slider, viewed_run
from tests.support.in_process import khr_here
from tests.support.runs import Bag, interrupt, joined, khr, wait_for, wait_until_running

STANDING = re.compile(r'^standing, [\d.]+ s$')
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


@pytest.fixture(scope='module')
def viewed(tmp_path_factory):
    """A standing robot on show, whose bag is looked at when it has ended."""
    with viewed_run(tmp_path_factory.mktemp('page') / 'run', 'stand_0deg') as process:
        yield process


@pytest.fixture(scope='module')
def page(viewed):
    with browser_page() as (page, asked):
        page.asked = asked
        page.goto(f'http://127.0.0.1:{viewed.port}/')
        slider(page, 'Ankle gain K_A').wait_for()
        yield page


def test_the_page_asks_nobody_else(page, viewed):
    page.get_by_text(STANDING).wait_for()
    hosts = {
        re.match(r'\w+://([^/]*)', url)[1] for url in page.asked if url[:4] in ('http', 'ws:/')
    }
    assert hosts == {f'127.0.0.1:{viewed.port}'}


def test_what_runs_is_named_and_chosen(page, viewed):
    page.get_by_role('cell', name=load_scenario('stand_0deg').title, exact=True).wait_for()
    chosen = row(page, 'Scenario', 'input').locator('input').first
    assert chosen.input_value() == 'stand_0deg'


def test_the_spectrum_comes_after_the_first_whole_cycle(page, viewed):
    come = re.compile('Spectrum of the pitch rate(, deg/s, over|: the robot is still)')
    page.get_by_text(come).first.wait_for()


def test_keyboard_alone_reaches_every_control(page):
    controls = [
        control
        for role in ('slider', 'checkbox', 'button', 'textbox', 'combobox')
        for control in page.get_by_role(role).all()
    ]
    assert len(controls) > 20
    for number, control in enumerate(controls):
        control.evaluate('(each, number) => each.dataset.number = number', number)
    missed = {str(number) for number in range(len(controls))}
    for _ in range(3 * len(controls)):
        if missed:
            page.keyboard.press('Tab')
            missed.discard(page.evaluate('document.activeElement.dataset.number'))
    assert not missed


def test_a_slider_changes_the_parameter_of_the_node(page, viewed):
    thumb = slider(page, 'Ankle gain K_A')
    thumb.focus()
    for _ in range(4):
        page.keyboard.press('ArrowRight')
    assert thumb.get_attribute('aria-valuenow') == '14'
    domain = ('--domain', viewed.domain)
    wait_for(lambda: gain(domain) == 14.0, 'the gain')
    box = thumb.bounding_box()
    page.mouse.move(box['x'] + box['width'] / 2, box['y'] + box['height'] / 2)
    page.mouse.down()
    page.mouse.move(box['x'] + 40, box['y'] + box['height'] / 2, steps=8)
    page.mouse.up()
    wait_for(
        lambda: 20.0 < (gain(domain) or 0.0) == float(thumb.get_attribute('aria-valuenow')),
        'the new gain',
    )


def gain(domain):
    shown = khr_here('get', 'ankle_controller', 'gain', *domain)
    return yaml.safe_load(shown.out)['gain'] if shown.code == 0 else None


def test_a_change_from_elsewhere_moves_the_slider(page, viewed):
    assert khr_here('set', 'hip_controller', 'gain', '20', '--domain', viewed.domain).code == 0
    wait_for(
        lambda: (
            page.wait_for_timeout(50)
            or slider(page, 'Hip gain K_H').get_attribute('aria-valuenow') == '20'
        ),
        'the slider',
    )


def test_a_push_by_button_moves_the_robot_pause_halts_it_and_restart_runs_it_again(page, viewed):
    page.get_by_role('button', name='Pause').click()
    page.get_by_text(re.compile('^paused at')).wait_for()
    page.get_by_role('button', name='Push', exact=True).click()
    page.get_by_role('button', name='Go on').click()
    page.get_by_text(STANDING).wait_for()
    before = slider(page, 'Ankle gain K_A').get_attribute('aria-valuenow')
    page.get_by_role('button', name='Restart').click()
    wait_until_running(second(viewed))
    page.get_by_text(STANDING).wait_for()
    assert slider(page, 'Ankle gain K_A').get_attribute('aria-valuenow') == before
    assert gain(('--domain', viewed.domain)) == float(before)


def second(viewed):
    """Return the folder of the run after the first."""
    return viewed.folder.with_name(f'{viewed.folder.name}-2')


def test_a_drag_of_the_torso_pushes_it(page, viewed):
    """One may be lost that begins while the page is drawn anew; the bag is looked at later."""
    with joined(second(viewed)) as node:
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


def test_a_phone_shows_the_robot_above_the_controls_and_signals_first(page, viewed):
    phone = page.context.browser.new_page(viewport={'width': 390, 'height': 800})
    phone.goto(f'http://127.0.0.1:{viewed.port}/')
    pause = phone.get_by_role('button', name='Pause')
    pause.wait_for()
    top = phone.get_by_text('khr', exact=True).first.bounding_box()['y'] - 12
    assert top > 0.35 * 800
    wait_for(lambda: torso_rows(phone, top).size > 50, 'the torso')
    assert 0.25 * top < np.median(torso_rows(phone, top)) < 0.6 * top
    assert pause.bounding_box()['width'] > 350
    signals = phone.get_by_role('button', name=re.compile('panel Signals'))
    assert signals.bounding_box()['y'] < pause.bounding_box()['y']
    signals.click()
    chart(phone, 'Spectrum').wait_for()
    wait_for(lambda: chart(phone, 'Spectrum').bounding_box()['y'] < 500, 'the spectrum')
    box = chart(phone, 'Spectrum').bounding_box()
    assert box['x'] >= 0 and box['x'] + box['width'] <= 390
    signals.click()
    phone.get_by_role('button', name='Push', exact=True).scroll_into_view_if_needed()
    assert phone.evaluate('document.documentElement.scrollWidth') <= 390
    phone.close()


def torso_rows(page, bottom):
    """Return the row of each pixel of the torso's blue above a height of the page, px."""
    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert('RGB'), dtype=int)
    picture = picture[: int(bottom)]
    return np.nonzero(is_torso(*np.moveaxis(picture, 2, 0)))[0]


def is_torso(red, green, blue):
    return (blue > 90) & (blue > 2 * red) & (blue > 1.6 * green)


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


def test_a_taken_port_is_one_line(viewed, tmp_path):
    done = khr('view', 'stand_0deg', '--port', viewed.port, '--out', tmp_path / 'run')
    assert done.code == 2
    assert f'--port: {viewed.port} on 127.0.0.1' in done.err.splitlines()[-1]
    assert 'Traceback' not in done.err


def test_all_that_was_done_is_in_the_bags(page, viewed):
    """Last in the module: it ends the run."""
    ended = interrupt(viewed, signal.SIGINT)
    assert ended.code == 0, ended.err
    bag = ended.bag()
    outcome = json.loads((viewed.folder / 'outcome.json').read_text())
    gains = [
        each['value']
        for each in outcome['changes']
        if each['parameter'] == 'ankle_controller.gain'
    ]
    assert 14.0 in gains
    verified = khr_here('verify', second(viewed))
    assert verified.out.splitlines()[-1] == 'same', verified.out
    ((_, push),) = bag['/simulator/push']
    assert push.wrench.force.x == 5.0
    pushed = push.header.stamp.sec + push.header.stamp.nanosec / 1e9
    rates = [
        (time / 1e9, message.angular_velocity.y) for time, message in bag['/ground_truth/imu']
    ]
    before = max(abs(rate) for time, rate in rates if pushed - 0.5 < time <= pushed)
    after = max(abs(rate) for time, rate in rates if pushed < time < pushed + 0.3)
    assert after > 10 * before
    (_, dragged), *_ = Bag(second(viewed) / 'bag')['/simulator/push']
    assert hypot(dragged.wrench.force.x, dragged.wrench.force.y) > 1.0
