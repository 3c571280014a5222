"""``khr bout``: folder, bags, repetition, film and reports of both robots; how they move."""

import json
import signal
from math import atan2, degrees, hypot

import pytest
from PIL import Image

from khr.runs import load
from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.offline import run_bout
from khr_bringup.bout.recorded import played
from khr_view.charts.charts import BLUE, RED
from khr_view.page.scene_view import shapes
from khr_view.playback import PlayedRuns, timelines
from tests.support.in_process import khr_here
from tests.support.runs import Bag, finish, khr, start_khr, wait_for

OFFLINE = ('--offline', '--engine', 'mujoco')
SHORT = (*OFFLINE, '--set', 'referee.time_limit=0.3', '--set', 'referee.rounds=2')


@pytest.fixture(scope='module')
def fought(tmp_path_factory):
    """Return the folder of a short bout of two rounds, and the summary that was printed."""
    folder = tmp_path_factory.mktemp('bout') / 'fought'
    ended = khr('bout', 'shove', *SHORT, '--out', folder)
    assert ended.code == 0, ended.err
    return folder, ended.out


def test_the_summary_has_winner_hashes_and_folder(fought):
    folder, said = fought
    stored = json.loads((folder / 'bout.json').read_text())
    hashes = [each['trajectory_hash'] for each in stored['rounds']]
    assert len(set(hashes)) == 2  # each round has its own noise
    for number, each in enumerate(hashes, 1):
        assert f'round {number} trajectory hash {each}' in said
    assert 'draw (0 : 0)' in said
    assert f'folder {folder}' in said


def test_a_change_of_a_bout_that_repeats_bit_for_bit_is_found(fought, tmp_path):
    folder, _ = fought
    stored = json.loads((folder / 'bout.json').read_text())
    for each in folder.iterdir():
        (tmp_path / each.name).symlink_to(each)
    (tmp_path / 'bout.json').unlink()
    without = khr_here('verify', tmp_path)
    assert (without.code, without.err.count('\n')) == (2, 1)
    assert 'accepted: bout.json of a finished bout' in without.err
    stored['rounds'][1]['blue']['verdict'] = 'fell'
    (tmp_path / 'bout.json').write_text(json.dumps(stored))
    other = khr_here('verify', tmp_path)
    assert other.code == 1
    assert 'round 2 blue: compared 21 samples of' in other.out
    assert 'bout.json: rounds: differs' in other.out


def test_a_bag_holds_both_robots_and_one_clock(fought):
    folder, _ = fought
    place = folder / 'round_1'
    red, blue = (load(place, namespace=robot) for robot in ('red', 'blue'))
    assert len(red.signals.time) == len(blue.signals.time) == 21
    assert red.signals.pose[0, 0] < 0.0 < blue.signals.pose[0, 0]
    assert red.scenario.of('gait')['motion'] == 'file'
    assert blue.scenario.of('gait')['motion'] == 'stand'
    assert load(folder, namespace='/blue').trajectory_hash == blue.trajectory_hash


def test_a_recorded_bout_is_played_with_both_robots_in_their_suits(fought):
    folder, _ = fought
    place = played(folder)
    assert place == folder / 'round_1'
    runs, together = timelines([place])
    assert together and [run.name for run in runs] == ['red', 'blue']
    red, blue = (run.snapshot(0.3) for run in runs)
    assert red.base[0] < 0.0 < blue.base[0]
    assert (0.72, 0.12, 0.10) in {shape.color for shape in shapes(runs[0].robot)}
    assert (0.12, 0.25, 0.62) in {shape.color for shape in shapes(runs[1].robot)}
    assert {
        line.color for chart in PlayedRuns(runs, (RED, BLUE)).charts for line in chart.lines
    } == {RED, BLUE}
    alone, together = timelines([place], 'blue')
    assert not together and len(alone) == 1


@pytest.mark.parametrize(
    ('arguments', 'says'),
    [
        (['view', 'shove', '--duration', '5'], 'of a bout; accepted: --set referee.time_limit='),
        (['run', 'shove'], 'shove: a bout; accepted: khr bout shove'),
        (['bout', 'shove', '--offline', '--view'], '--view: not with --offline'),
        (['bout', 'shove', '--set', 'referee.round=3'], 'did you mean rounds?'),
    ],
)
def test_what_a_bout_does_not_have_is_refused(arguments, says):
    ended = khr_here(*arguments)
    assert (ended.code, ended.err.count('\n')) == (2, 1)
    assert says in ended.err


def test_a_still_of_a_bout_shows_both_robots(fought, tmp_path):
    folder, _ = fought
    ended = khr_here(
        'film', folder, '--still', '0.2', '--width', 320, '--height', 240, '--out', tmp_path / 'a'
    )
    assert ended.code == 0, ended.err
    with Image.open(tmp_path / 'a.png') as picture:
        assert picture.size == (320, 240)
        edge = picture.convert('L').crop((314, 0, 320, 24))  # right of the title, which is long
        assert min(edge.get_flattened_data()) > 200
        pixels = list(picture.convert('RGB').get_flattened_data())
    assert sum(r > 100 and g < 60 and b < 60 for r, g, b in pixels) > 50  # the red suit
    assert sum(r < 60 and g < 90 and b > 90 for r, g, b in pixels) > 50  # and the blue one


def test_verbs_of_one_robot_ask_for_it_of_a_whole_bout_and_a_film_takes_no_other(fought, tmp_path):
    which = 'namespace: needed, there are several robots; accepted: /blue, /red'
    for arguments, says in (
        (('film', '--against', 'last'), 'not accepted of a bout'),
        (('report',), which),
        (('export',), which),
    ):
        ended = khr_here(arguments[0], fought[0], *arguments[1:])
        assert (ended.code, ended.err.count('\n')) == (2, 1)
        assert says in ended.err
    file = tmp_path / 'blue.csv'
    ended = khr_here('export', fought[0], '--namespace', 'blue', '--out', file)
    assert ended.code == 0, ended.err
    assert file.read_text().startswith('"time, s",')


def test_each_robot_has_a_page_of_its_own_that_misses_no_file(fought):
    folder, _ = fought
    for robot in ('red', 'blue'):
        ended = khr_here('report', folder, '--namespace', robot)
        assert (ended.code, ended.err) == (0, '')
        text = (folder / 'round_1' / f'report_{robot}.html').read_text()
        assert f'<title>Run fought_round_1, {robot}</title>' in text
        assert f': robot {robot} (fought_round_1)' in text
        assert 'is missing' not in text and 'the slope' not in text
        assert 'href="../bout.json"' in text
    assert 'href="report_red.html"' in text


def test_an_interrupted_bout_is_one_line_and_keeps_its_bag(tmp_path):
    folder = tmp_path / 'bout'
    process = start_khr('bout', 'shove_guard', *OFFLINE, '--out', folder)
    bag = folder / 'round_1' / 'bag'
    wait_for(lambda: [each.stat().st_size for each in bag.glob('*.mcap')] > [0], 'samples')
    process.send_signal(signal.SIGINT)
    ended = finish(process, folder)
    assert ended.code == 130
    assert 'khr: interrupted before the bout had ended; its folder stays' in ended.err
    assert 'Traceback' not in ended.err
    assert Bag(bag)['/blue/imu/data_raw']


@pytest.mark.parametrize('bout', ['shove', 'shove_one_arm'])
def test_a_shove_topples_who_only_stands(bout):
    """As the title says, and the robot that shoves stays up."""
    result = run_bout(load_bout(bout).set_to(['simulator.engine=mujoco']))
    assert (result.winner, result.rounds[0].decision.reason) == ('red', 'blue down for 3 s')


def test_the_first_of_two_shoves_wins_a_duel():
    """As the motions of both are the same."""
    duel = load_bout('duel').set_to(['simulator.engine=mujoco', 'referee.time_limit=6.0'])
    assert run_bout(duel).winner == 'red'
    turned = duel.set_to(['red.gait.start_delay=2.0', 'blue.gait.start_delay=1.0'])
    assert run_bout(turned).winner == 'blue'


@pytest.mark.slow
@pytest.mark.parametrize(('surface', 'engine'), [('rubber', 'bullet'), ('smooth', 'mujoco')])
def test_both_robots_turn_on_the_spot(engine, surface):
    cycles, poses = 2, {'red': [], 'blue': []}

    def watch(_, __, truths, ___):
        for robot, truth in truths.items():
            x, y, z, w = truth.orientation
            heading = degrees(atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
            poses[robot].append((heading, *truth.position[:2]))

    changes = [f'gait.cycles={cycles}', f'referee.time_limit={2.0 + 3.4 * cycles}']
    changes += [f'simulator.engine={engine}', f'simulator.surface={surface}']
    (only,) = run_bout(load_bout('turn').set_to(changes), watch).rounds
    assert {each.verdict for each in only.outcomes.values()} == {'stood'}
    for robot, sign in (('red', -1.0), ('blue', 1.0)):
        (start, *here), (end, *there) = poses[robot][0], poses[robot][-1]
        turned = sign * ((end - start + 180.0) % 360.0 - 180.0) / cycles
        assert 12.0 < turned < 15.8
        assert hypot(there[0] - here[0], there[1] - here[1]) < 0.015 * cycles
