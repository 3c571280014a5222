"""The whole page without a browser: what is drawn and what its controls do."""

from itertools import product
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest

from khr_common.interfaces import GYRO, JOINT_STATES, JOINTS
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view.charts.charts import charts
from khr_view.charts.spectrum_lines import PlacedPeak, spectrum_lines
from khr_view.charts.traces import Traces
from khr_view.controls import Control, tunables
from khr_view.guard import listen
from khr_view.model.scene import SnapshotBuilder
from khr_view.page.display import VIEWS, Display
from khr_view.page.panels import LivePanel
from khr_view.playback import SIDE

PERIOD = 15_000_000


@pytest.fixture(scope='module')
def display():
    display = Display(listen(), charts())
    yield display
    display.close()


@pytest.fixture(scope='module')
def two_robots():
    display = Display(listen(), charts(), ['one', 'two'])
    display.add_robot(Robot.load(), name='one')
    display.add_robot(Robot.load(), (0.0, -SIDE, 0.0), 'two')
    yield display
    display.close()


@pytest.fixture(scope='module')
def panel(display):
    scenarios = ['walk_3deg', 'walk_0deg']
    return LivePanel(display.server, display.later, scenarios, 'same')


def button(panel, name):
    found = getattr(panel, f'_{name}')
    return found.label, not found.disabled


def test_an_older_value_does_not_move_a_control_that_the_reader_has_just_changed(panel, display):
    changed, done = [], Event()
    gain = next(each for each in tunables() if each.key == ('ankle_controller', 'gain'))
    panel.begin(SimpleNamespace(change=lambda *change: changed.append(change)), None)
    panel.add(Control(gain, 12.0, 'hint', minimum=0.0, maximum=60.0))
    slider = panel._handles[gain.key]

    def shown(value):
        panel.show_value(gain, value)
        display.server.get_event_loop().call_soon_threadsafe(done.set)
        assert done.wait(5.0)
        done.clear()
        return slider.value

    assert shown(12.5) == 12.5
    slider.value = 14.0
    panel._change(gain, 14.0)
    assert shown(13.0) == 14.0 and not changed
    display.act()
    assert changed == [(gain, 14.0)]
    assert shown(13.0) == 13.0


@pytest.mark.slow
def test_only_what_runs_or_is_paused_and_a_driver_offers_can_be_halted(panel):
    shown = {
        'waiting': ('Pause', False),
        'running': ('Pause', True),
        'paused': ('Go on', True),
        'finished': ('Pause', False),
    }
    for state, expected in shown.items():
        panel.show_state(state)
        panel.show_offers(True, True)
        assert button(panel, 'pause') == expected
        panel.show_offers(False, False)
        assert button(panel, 'pause') == ('No pause: the driver has none', False)
        assert button(panel, 'push') == ('No push: the driver takes none', False)


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
    display.show_status('walking', [('time', '1.00 s')], '<trouble>')


def test_the_view_that_a_reader_chose_holds_for_the_robot_of_the_next_run(display):
    robot = Robot.load()
    display.add_robot(robot)
    display._show_marks(False)
    display._see_through(True)
    first = display._robots[-1]
    display.restart()
    display.add_robot(robot)
    (second,) = display._robots
    assert second is not first
    assert (second.marks._visible, second._shapes[0].opacity) == (False, first._shapes[0].opacity)
    display._show_marks(True)
    display._see_through(False)


@pytest.mark.parametrize('aspect', [660 / 850, 390 / 338], ids=['window', 'phone'])
@pytest.mark.parametrize('name', VIEWS)
def test_every_view_shows_the_whole_of_two_robots(two_robots, name, aspect):
    camera = SimpleNamespace(position=None, look_at=None)
    two_robots._look_from(name, SimpleNamespace(client=SimpleNamespace(camera=camera)))
    initial = two_robots.server.initial_camera
    if name == 'Default view':
        assert np.allclose(initial.position, camera.position)
        assert np.allclose(initial.look_at, camera.look_at)
    forward = np.subtract(camera.look_at, camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    highest = np.tan(initial.fov / 2.0)
    for x, y, z in product((-0.12, 0.12), (0.12, -SIDE - 0.12), (0.0, 0.42)):
        corner = np.subtract((x, y, z), camera.position)
        depth = corner @ forward
        assert abs(corner @ up) < highest * depth
        assert abs(corner @ right) < aspect * highest * depth
