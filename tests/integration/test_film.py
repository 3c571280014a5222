"""Films: the pictures are those of the run, and the run is the one recorded."""

import json
import weakref
from math import pi

import numpy as np
import pytest
from PIL import Image

from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.result import RunRecord
from khr_bringup.scenario.control_text import control_of
from khr_bringup.scenario.scenario import load_scenario
from khr_common import KhrError, RunError
from khr_common.rotation import matrix, pitched
from khr_description.robot import Robot
from khr_report.film.film import render, render_run, save_gif
from khr_report.film.overlay import FAINT, LEFT, MASS, PRESSURE, RIGHT, TRACE, VERDICTS, Overlay
from khr_report.film.scene import Look, PosedScene, Shadow, frames, scenario_of, source_of
from khr_sim.physics.camera import Camera
from tests.support.runs import khr

SMALL = (96, 80, 20.0)


def short(seconds=0.3):
    return load_scenario('walk_3deg').changed({('simulator', 'duration'): seconds})


@pytest.fixture
def folder(tmp_path):
    """Make a run folder."""
    (tmp_path / 'scenario.yaml').write_text(short().to_yaml())
    return tmp_path


@pytest.fixture(scope='module')
def kept():
    return frames(short())


@pytest.fixture(scope='module')
def walked():
    return frames(short(1.5))


def near(picture, spot, color, reach=6):
    """Return how many pixels around a spot have about the hue of a colour."""
    x, y = (round(value) for value in spot)
    part = picture[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] / 255.0
    return int((np.abs(part - color).max(axis=-1) < 0.2).sum())


@pytest.mark.parametrize('yaw', [2.2, -2.2])
def test_the_feet_are_where_the_run_has_them_and_told_apart(walked, yaw):
    scene, look = PosedScene(short()), Look(480, 360, yaw=yaw, pitch=-0.4)
    for frame in walked[::25]:
        camera = look.camera(frame.truth)
        picture = np.asarray(scene.picture([frame.truth], camera)[0])
        left, right = camera.pixels(frame.truth.sole_position)
        blue, orange = np.divide((LEFT, RIGHT), 255.0)
        behind, before = ((left, blue), (right, orange))[:: 1 if yaw > 0.0 else -1]
        assert near(picture, *before) > 20, 'the nearer foot hides the other in part'
        assert near(picture, before[0], behind[1]) == 0
        assert near(picture, *behind, reach=12) > 0
    scene.close()


def test_a_point_of_odom_is_where_the_renderer_puts_it():
    """The target is in the middle; what is ahead of the robot is on the right, seen from there."""
    camera = Camera(400, 300, (0.1, 0.0, 0.2), yaw=pi / 2.0, pitch=-0.1, distance=1.0)
    seen = camera.pixels(np.array((camera.target, (0.2, 0.0, 0.2), (0.1, 0.0, 0.3))))
    assert seen[0] == pytest.approx((200.0, 150.0))
    assert seen[1, 0] > 210.0 and seen[1, 1] == pytest.approx(150.0)
    assert seen[2, 1] < 140.0


def test_the_shadow_lies_on_the_slope_and_begins_at_the_soles():
    frame = frames(short(0.03).changed({('simulator', 'inclination_deg'): 8.0}))[-1]
    thrown = Shadow(Robot.load()).on_slope(frame.truth).reshape(-1, 3)
    normal = matrix(pitched(frame.truth.inclination))[:, 2]
    assert np.abs(thrown @ normal).max() < 1e-12
    for sole in frame.truth.sole_position:
        assert np.linalg.norm(thrown - sole, axis=1).min() < 0.075, 'half the diagonal of a sole'
    camera = Look(480, 360, pitch=-0.5).camera(frame.truth)
    scene = PosedScene(short())
    lit = np.asarray(scene.picture([frame.truth], camera)[0]).astype(int)
    scene._shadow.darken = lambda *_: None
    bare = np.asarray(scene.picture([frame.truth], camera)[0]).astype(int)
    scene.close()
    assert 0.003 < (lit != bare).any(axis=-1).mean() < 0.2 and (lit <= bare).all()


def test_the_overlay_says_what_acts_and_what_becomes_of_it(kept):
    scenario = load_scenario('walk_9.7deg_ka12_kh13')
    assert control_of(scenario) == 'K_A 12 (gyro), K_H 13'
    off = {('ankle_controller', 'enabled'): False, ('hip_controller', 'enabled'): False}
    assert control_of(scenario.changed(off)) == 'without control'
    overlay, camera = Overlay(short(), kept, 240), Look(320, 240).camera(kept[-1].truth)
    pictures = []
    for each in kept[::19][:2]:
        blank = Image.new('RGB', (320, 240), 'white')
        overlay.draw(blank, each, camera)
        pictures.append(np.asarray(blank))
    stood, later = pictures
    green = (np.abs(stood[:40].astype(int) - VERDICTS['stood']).max(axis=-1) < 3).sum()
    assert kept[-1].outcome.verdict == 'stood' and green > 200
    assert (stood != later).any()


def test_the_overlay_shows_the_balance_from_above_and_over_time(kept):
    overlay, camera = Overlay(short(), kept, 720), Look().camera(kept[-1].truth)
    blank = Image.new('RGB', (960, 720), 'white')
    overlay.draw(blank, kept[-1], camera)
    picture = np.asarray(blank).astype(int)
    above, balance, rate = picture[120:300, 20:200], picture[600:, 330:600], picture[600:, 640:]
    for part, color in (
        (above, PRESSURE),
        (balance, PRESSURE),
        (balance, FAINT),
        (rate, TRACE),
        (rate, PRESSURE),
    ):
        assert (np.abs(part - color).max(axis=-1) < 30).sum() > 20
    robot = Image.new('RGB', (960, 720), 'black')
    overlay.draw(robot, kept[-1], camera)
    center = camera.pixels(overlay._balances[-1].center_of_mass)
    assert near(np.asarray(robot), center, np.divide(MASS, 255.0)) > 80, 'over the robot'


def test_corrections_are_drawn_with_their_constant_part(kept):
    lean = ('ankle_controller.enabled=true', 'ankle_controller.lean_deg=3.0')
    scenario = short().set_to(lean)
    leaning = frames(scenario)
    panel = Overlay(scenario, leaning, 720)._corrections
    (_, constant), (color, ankle) = panel.lines
    assert color == LEFT and panel.full >= 5.0
    assert constant[-1] == pytest.approx(0.9), 'within start_ramp, 1 s'
    assert np.ptp(ankle - constant) > 0.05, 'the share of the loop'
    assert Overlay(short(), kept, 720)._corrections is None
    blank = Image.new('RGB', (960, 720), 'white')
    Overlay(scenario, leaning, 720).draw(blank, leaning[-1], Look().camera(leaning[-1].truth))
    part = np.asarray(blank).astype(int)[95:220, 645:]
    assert (np.abs(part - LEFT).max(axis=-1) < 30).sum() > 20


def test_two_runs_are_side_by_side_the_shorter_waits_and_one_is_a_film_too(folder, tmp_path):
    longer = tmp_path / 'longer'
    longer.mkdir()
    (longer / 'scenario.yaml').write_text(short(0.6).to_yaml())
    _, together = render_run(str(folder), tmp_path / 'both', size=SMALL, against=str(longer))
    movie, animation = render_run(str(folder), size=SMALL)
    assert movie.parent == animation.parent == folder and movie.stat().st_size > 1000
    with Image.open(together) as both, Image.open(animation) as alone:
        assert (both.size, alone.size) == ((2 * SMALL[0], SMALL[1]), SMALL[:2])
        assert (both.n_frames, alone.n_frames) == (12, 6)  # 0.3 s at 20 per s
        both.seek(11)
        left = np.asarray(both.convert('RGB'))[:, : SMALL[0]]
        both.seek(8)
        np.testing.assert_array_equal(left, np.asarray(both.convert('RGB'))[:, : SMALL[0]])


def test_a_film_holds_few_pictures_in_memory(tmp_path):
    drawn, most = [], 0

    def draw(times):
        nonlocal most
        for time in times:
            picture = Image.new('RGB', (64, 64), (int(60 * time), 0, 0))
            drawn.append(weakref.ref(picture))
            most = max(most, sum(each() is not None for each in drawn))
            yield picture

    files = render(
        tmp_path / 'film', 3.96, draw, Look(64, 64, 25.0), None, (0.0, None), lambda *_: None
    )
    assert len(drawn) == 1 + 99 and most < 6
    assert all(each.stat().st_size for each in files)


@pytest.mark.parametrize('rate', [24.0, 60.0])
def test_a_gif_lasts_as_long_as_its_part(rate, tmp_path):
    shades = (Image.new('RGB', (64, 64), (each, 255 - each, 0)) for each in range(0, 240, 5))
    sample = Image.new('RGB', (64, 64), (120, 135, 0))
    save_gif(tmp_path / 'film.gif', shades, 48, sample, rate)
    with Image.open(tmp_path / 'film.gif') as gif:
        lasts = []
        for number in range(gif.n_frames):
            gif.seek(number)
            lasts.append(gif.info['duration'])
    assert sum(lasts) == pytest.approx(48e3 / rate, abs=10.0) and min(lasts) >= 20


def test_run_that_does_not_repeat_is_an_error(folder):
    (folder / 'outcome.json').write_text(
        json.dumps(RunRecord(end='duration', trajectory_hash='x').to_json())
    )
    with pytest.raises(RunError, match='did not repeat'):
        render_run(str(folder), still=0.0, size=SMALL)


@pytest.mark.parametrize(
    ('options', 'word'),
    [
        ({'size': (95, 80, 20.0)}, '--width'),
        ({'size': (96, 80, 0.0)}, '--rate'),
        ({'size': (962, 80, 9.0), 'against': 'walk_3deg'}, r'--width: 962 .* \[64, 960\]'),
        ({'still': 9.0, 'size': SMALL}, '--still'),
        ({'part': (5.0, 6.0), 'size': SMALL}, '--start'),
        ({'part': (0.1, 0.05), 'size': SMALL}, '--end'),
    ],
)
def test_arguments_are_refused(folder, options, word):
    with pytest.raises(KhrError, match=word):
        render_run(str(folder), **options)


@pytest.mark.parametrize(
    ('run', 'word'),
    [
        ('runs/nosuch', 'no such run or scenario'),
        ('walk_8.88', r'no such run or scenario; did you mean walk_8\.88deg_ka12 or walk_8\.88'),
        ('.', r'no scenario\.yaml in it'),
    ],
)
def test_what_is_no_run_is_refused(tmp_path, monkeypatch, run, word):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KhrError, match=word):
        scenario_of(run)


def test_a_recorded_run_is_filmed_as_it_was_recorded_changes_and_all(tmp_path):
    """A run in real time does not repeat, and a bag alone has no scenario.yaml beside it."""
    folder = tmp_path / 'run'
    khr('run', 'stand_0deg', '--realtime', '--duration', '0.5', '--no-draw', '--out', folder)
    for path in (folder, folder / 'bag'):
        source = source_of(str(path))
        kept = source.frames(lambda _: None)
        series = RecordedRun(path).series
        assert [frame.time for frame in kept] == pytest.approx(series.time.tolist())
        assert np.array_equal([frame.truth.joint_position for frame in kept], series.joints)
        assert np.array_equal([frame.corrections for frame in kept], series.correction)
    (still,) = render_run(str(folder / 'bag'), tmp_path / 'deep' / 'still.png', 0.3, size=SMALL)
    with Image.open(still) as picture:
        assert picture.size == SMALL[:2]
