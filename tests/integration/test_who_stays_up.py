"""A robot that slides down the board without falling has not stayed up, whoever is asked."""

import numpy as np
import pytest

import khr
import khr_studies.third_stage.study as third_stage
from khr_analysis.outcome_measures import Slides
from khr_bringup import offline
from khr_bringup.recorded.run_signals import run_with_series
from khr_studies.calibration import trial_robot
from khr_studies.calibration.ensemble import fails_on_level_ground
from khr_studies.calibration.objective import Candidate, Task, measure_robot
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.rows import WantedLimit, WantedWalk
from khr_studies.calibration.trial_robot import ENDS, TrialRobot
from khr_studies.engines import study as engines
from khr_studies.measuring import bench, critical
from khr_studies.measuring.bench import share_up
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.critical import Limit
from khr_studies.measuring.experiments import Run, table_of
from khr_studies.measuring.run_table import run_table, tally
from khr_studies.measuring.thesis_values import ThesisWalk
from khr_studies.scoreboard.walk_rows import walk_row
from khr_studies.stability_map.study import INCLINATION, stability_map
from khr_studies.tuning import study as tuning
from khr_sweeps.reading import parse_sweep
from khr_sweeps.results.folder import Folder, read_results
from khr_sweeps.trial import run_trial

PHI, GAIN = 7.0, 'ankle_controller.gain'
SLICK = Condition(
    'walk', 12.0, changes=((('simulator', 'friction'), 0.08), (('gait', 'cycles'), 3))
)
SCENARIO = SLICK.scenario(PHI, 0)
WALK = WantedWalk(0.0)
PLAN = CalibrationPlan({}, (WantedLimit('walk', 7.0),), walks=(WALK,))
SWEEP = parse_sweep(
    f'scenario: walk_6.99deg_ka12\nbisect: {INCLINATION}\n'
    f'grid:\n  {INCLINATION}: [5.0, 6.0, 7.0]\n  {GAIN}: [12.0]\n',
    'slick.yaml',
)


@pytest.fixture(scope='module')
def slide(tmp_path_factory):
    """Return the result of the one run, the file of its signals, what a watcher of it sees."""
    seen, run_offline = [], offline.run_offline

    def watched(scenario, watch):
        return run_offline(scenario, lambda *instant: (seen.append(instant), watch(*instant)))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(offline, 'run_offline', watched)
        result, series = run_with_series(SCENARIO)
    kept = tmp_path_factory.mktemp('slide') / 'series.npz'
    series.save(kept)
    return result, kept, seen


@pytest.fixture
def asked(slide, monkeypatch):
    """Let every run be this one; return its row in a sweep, and the run as an experiment's."""
    result, kept, seen = slide

    def again(scenario, watch=None):
        for instant in seen if watch else ():
            watch(*instant)
        return result

    for module in (offline, critical, trial_robot, tuning, engines):
        monkeypatch.setattr(module, 'run_offline', again)
    trial = next(iter(SWEEP.trials('v')))
    monkeypatch.setattr('khr_sweeps.trial.code_version', lambda: 'v')
    row, _ = run_trial(trial)
    return row, Run({INCLINATION: PHI, GAIN: 12.0}, 0, row, SCENARIO, kept)


def test_the_robot_slides_far_and_does_not_fall(slide):
    outcome = slide[0].outcome
    assert outcome.verdict == 'slipped' and outcome.largest_slip > 1.0
    assert not outcome.stayed_up and outcome.lasted(9.0) == 1.0
    assert outcome._replace(largest_slip=0.056, slides=Slides(after=0.056, steps=1)).stayed_up
    assert not outcome._replace(largest_slip=0.0).stayed_up
    assert not outcome._replace(largest_slip=0.0, slides=Slides(), verdict='fell').stayed_up


def test_the_search_of_a_limit_and_the_scoreboard_say_so(asked):
    limit = Limit.of(run_table(critical.limit_of_seed(SLICK, 0, PHI, 0.8)), 0.8)
    assert limit.of_seeds == critical.ENDS[:1] and limit.highest.empty
    walk = bench.walk(SLICK, PHI, 0)
    walks = run_table([walk, walk])
    assert share_up(walks) == 0.0 and walk['peaks_hz'] == []
    row = walk_row(ThesisWalk(PHI, SLICK, 'walks'), walks)
    assert (row['lost'], row['verdict'], row['slide_mm']) == (2, 'missed', None)
    falls = ThesisWalk(PHI, SLICK, 'falls', survives=False)
    assert walk_row(falls, walks)['verdict'] == 'passed'


def test_calibration_ensemble_and_tuning_say_so(asked, slide):
    robot = measure_robot(Task(PLAN, {}, ('bullet',), (0,), prune_above=1e9))
    assert robot.value(PLAN.limits[0].title) == ENDS[0]
    walked = TrialRobot((), 0.4).walk(WALK.condition, 0.0, 0)
    assert walked.lasted < 1.0
    values = {'bullet': {WALK.title: [walked.lasted]}}
    assert fails_on_level_ground(PLAN, Candidate({}, values))
    tried = tuning.attempt(SCENARIO)
    assert not tried['stayed_up']


def test_sweep_bisection_and_maps_say_so(asked, tmp_path):
    row, run = asked
    assert row['stayed_up'] is False
    trials = list(SWEEP.trials('v'))
    (next_one,) = SWEEP.due('v', {trials[1].id: row['stayed_up']})
    assert next_one is not trials[2] and next_one.point[INCLINATION] == 5.0
    with Folder(tmp_path, {'version': 'v', **SWEEP.record()}) as folder:
        folder.append([{'id': each.id, **each.point, 'seed': None, **row} for each in trials])
    counted = stability_map(read_results(tmp_path), INCLINATION, GAIN)
    assert (
        counted.of('up').sum() == counted.of('slipped').sum() == 0
        and counted.of('runs').sum() == 3
    )
    (cell,) = tally(table_of([run]), [INCLINATION, GAIN]).to_dict('records')
    assert (cell['runs'], cell['up'], cell['slipped']) == (1, 0, 0)


def test_third_stage_and_engines_say_so(asked, slide, monkeypatch):
    lifted = {'stayed_up': slide[0].outcome.stayed_up, 'overshoot_rad_s': 0.1}
    monkeypatch.setattr(third_stage, 'lift', lambda *_: lifted)
    assert third_stage.climb(third_stage.Setting(0.0, 0.5, 0.0), 'bullet', 0)['limit_deg'] == 0.0
    changes = ((('gait', 'cycles'), 3),)
    assert engines.measure_scenario('walk_6.99deg_ka12', changes)['verdict'] == 'rode down'


def test_the_gymnasium_environment_ends_the_episode():
    steps, over = 0, False
    with khr.env(SCENARIO) as environment:
        environment.reset()
        while not over:
            _, _, over, cut, info = environment.step(np.zeros(2))
            assert not cut and (info['reward_alive'] > 0.0) is not over
            steps += 1
    assert info['outcome'].verdict != 'fell' and 0.056 < info['outcome'].slides.last < 0.07
