"""The whole page without a browser: what is drawn and what its controls do."""

import asyncio
from time import monotonic
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from viser._messages import GuiUpdateMessage

from khr_common.interfaces import GYRO, JOINT_STATES, JOINTS
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view.charts.charts import charts
from khr_view.charts.spectrum_lines import PlacedPeak, spectrum_lines
from khr_view.charts.traces import Traces
from khr_view.guard import listen
from khr_view.model.snapshot import SnapshotBuilder
from khr_view.page.display import CAMERA, CAMERA_NARROW, Display, Note, _frame
from khr_view.page.live_panel import LivePanel
from khr_view.page.playback_panel import PlaybackPanel
from khr_view.playback import Player
from tests.support.browser import connected

PERIOD = 15_000_000


@pytest.fixture(scope='module')
def display():
    display = Display(listen(), charts())
    yield display
    display.close()


@pytest.fixture(scope='module')
def panel(display):
    scenarios = ['walk_3deg', 'walk_0deg']
    return LivePanel(display.server, display.later, scenarios, 'same')


def button(panel, name):
    found = getattr(panel, f'_{name}')
    return found.label, not found.disabled


@pytest.mark.slow
def test_only_what_runs_or_is_paused_can_be_halted(panel):
    for state, shown in {
        'waiting': ('Pause', False),
        'running': ('Pause', True),
        'paused': ('Go on', True),
        'finished': ('Pause', False),
    }.items():
        panel.show_state(state)
        panel.show_offers(True, True)
        assert button(panel, 'pause') == shown


@pytest.mark.parametrize('playing', [False, True])
def test_a_time_that_a_reader_chooses_is_not_lost_while_the_page_shows_others(display, playing):
    player = Player(end=10.0, period=0.5, playing=playing)
    panel = PlaybackPanel(display.server, display.later, player, [])
    panel.show(player)
    loop = display.server.get_event_loop()
    with connected(display.server.get_port()) as connection:
        for time in (7.0, 3.0, 9.5, 0.5) * 5:
            update = GuiUpdateMessage(panel._time._impl.uuid, {'value': time})
            connection.send(msgspec.msgpack.encode(update.as_serializable_dict([])))
            patience = monotonic() + 20.0
            while abs(player.now - time) > 0.2:  # it plays on
                assert monotonic() < patience, f'{time} s was lost'
                player.advance(1e-7)
                display.act()
                panel.show(player)
                asyncio.run_coroutine_threadsafe(asyncio.sleep(0.0), loop).result()


def test_what_a_driver_does_not_offer_is_disabled_and_says_so_in_every_state(panel):
    panel.show_offers(False, False)
    for state in ('running', 'finished'):
        panel.show_state(state)
        assert button(panel, 'pause') == ('No pause: the driver has none', False)
    assert button(panel, 'push') == ('No push: the driver takes none', False)
    panel.show_offers(True, True)
    panel.show_state('running')
    assert button(panel, 'pause') == ('Pause', True)


def test_a_robot_its_signals_and_its_spectrum_are_drawn_and_saved(display):
    robot = Robot.load()
    builder = SnapshotBuilder(robot, RunParameters())
    scene = builder.build(builder.completed({JOINT_STATES: (0.0,) * len(JOINTS)}))
    display.add_robot(robot, name='one', push=lambda force, done: None)
    display.show_scenes([scene])
    display.show_push(scene, np.array([5.0, 0.0, 0.0]), acts=True)
    display.show_scenes([scene])
    traces = Traces()
    for number in range(5):
        traces.add(GYRO, number * PERIOD, (0.0, 0.1, 0.0))
    display.show_traces(traces)
    assert len(display.server.tables['signals.csv']().splitlines()) == 6
    lines = spectrum_lines([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], [PlacedPeak(1.0, 1.0)], 2.0)
    display.show_spectrum(lines)
    assert len(display.server.tables['spectrum.csv']().splitlines()) > 3
    display.show_spectrum(None)
    assert len(display.server.tables['spectrum.csv']().splitlines()) == 1
    display.show_status(Note('walking', '<trouble>'), [('time', '1.00 s')])


def test_the_camera_follows_a_window_that_becomes_narrow_or_wide_and_else_the_reader():
    turned = []
    camera = SimpleNamespace(aspect=1.6, position=CAMERA, look_at=None, on_update=turned.append)
    _frame(SimpleNamespace(camera=camera))
    (on_camera,) = turned
    for aspect, position, expected in (
        (1.6, (9, 9, 9), (9, 9, 9)),  # the reader has turned it
        (0.5, (9, 9, 9), CAMERA_NARROW),
        (0.4, (8, 8, 8), (8, 8, 8)),
        (0.8, (8, 8, 8), CAMERA),
    ):
        camera.aspect, camera.position = aspect, position
        on_camera(camera)
        assert camera.position == expected, aspect
