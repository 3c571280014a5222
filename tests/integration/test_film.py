"""Films: the pictures are those of the run, and the run is the one recorded."""

import json
from math import nan

import numpy as np
import pytest
from PIL import Image

from khr_bringup.offline import ControlLoop
from khr_bringup.scenario import load
from khr_common import KhrError, RunError
from khr_common.rotation import matrix
from khr_report.film import HALF_HEIGHT, Look, PosedScene, frames, render_run, scenario_of
from khr_sim.camera import Camera
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters

SMALL = (96, 80, 20.0)


def short(seconds=0.3):
    return load('walk_3deg').changed({('simulator', 'duration'): seconds})


@pytest.fixture
def folder(tmp_path):
    """Make a run folder."""
    (tmp_path / 'scenario.yaml').write_text(short().to_yaml())
    return tmp_path


def test_stage_shows_what_the_world_of_the_run_would_show():
    scenario = short()
    plant, loop = Plant(scenario.table(RunParameters)), ControlLoop(scenario)
    due = loop.reference(0.0)
    truth = plant.start(due)
    for _ in range(10):
        truth, due = plant.advance(due), loop.answer(truth)
    look = Look(96, 80)
    stage = PosedScene(scenario, look)
    middle = truth.sole_position.mean(axis=0)
    target = (float(middle[0]), 0.0, float(middle[2]) + HALF_HEIGHT)
    live = plant.world.engine.picture(Camera(96, 80, target, look.yaw, look.pitch, look.distance))
    shown = stage.picture(truth)
    plant.world.close()
    stage.close()
    assert np.mean(live != shown) < 0.002
    assert np.ptp(shown) > 100


def test_robot_on_film_stands_on_its_feet():
    truth = frames(short(0.03))[-1].truth
    normal = matrix((0.0, np.sin(truth.inclination / 2), 0.0, np.cos(truth.inclination / 2)))[:, 2]
    assert np.abs(truth.sole_position @ normal).max() < 0.001


def test_film_has_its_pictures_in_both_files(folder):
    movie, animation = render_run(str(folder), size=SMALL)
    assert movie.parent == animation.parent == folder
    assert movie.stat().st_size > 1000
    with Image.open(animation) as gif:
        assert gif.size == SMALL[:2]
        assert gif.n_frames == 6  # 0.3 s at 20 per s


def test_still_is_one_picture(folder, tmp_path):
    (path,) = render_run(str(folder), tmp_path / 'deep' / 'still.png', 0.1, size=SMALL)
    with Image.open(path) as picture:
        assert picture.size == SMALL[:2]


def test_run_that_does_not_repeat_is_an_error(folder):
    (folder / 'outcome.json').write_text(json.dumps({'end': 'duration', 'trajectory_hash': 'x'}))
    with pytest.raises(RunError, match='did not repeat'):
        render_run(str(folder), still=0.0, size=SMALL)


@pytest.mark.parametrize(
    ('options', 'word'),
    [
        ({'size': (95, 80, 20.0)}, '--width'),
        ({'size': (96, 80, 0.0)}, '--rate'),
        ({'still': 9.0, 'size': SMALL}, '--still'),
        ({'still': nan, 'size': SMALL}, '--still'),
        ({'part': (5.0, 6.0), 'size': SMALL}, '--start'),
        ({'part': (0.1, 0.05), 'size': SMALL}, '--end'),
    ],
)
def test_arguments_are_refused(folder, options, word):
    with pytest.raises(KhrError, match=word):
        render_run(str(folder), **options)


def test_name_with_degrees_keeps_them(tmp_path):
    (path,) = render_run('walk_5.55deg', tmp_path / 'walk_5.55deg', 0.0, size=SMALL)
    assert path.name == 'walk_5.55deg.png'


@pytest.mark.parametrize(
    ('run', 'word'),
    [
        ('runs/nosuch', 'no such run; accepted: the folder of a run, or a scenario'),
        ('nosuch', 'no such scenario'),
        ('.', r'no scenario\.yaml in it'),
    ],
)
def test_what_is_no_run_is_refused(tmp_path, monkeypatch, run, word):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KhrError, match=word):
        scenario_of(run)
