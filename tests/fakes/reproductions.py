"""Invented reproductions of the thesis, with figures, maps, runs and findings."""

from dataclasses import replace
from itertools import count
from pathlib import Path

from matplotlib.figure import Figure

from khr_analysis.outcome import RIDES
from khr_bringup.scenario.scenario import load_scenario
from khr_studies.measuring.experiments import Run
from khr_studies.reproduction.findings import Findings
from khr_studies.reproduction.pictures import FigureResult
from khr_studies.reproduction.reproduce import Reproduction
from khr_studies.scoreboard.study import compare
from khr_studies.stability_map.study import MapResult
from tests.fakes.benches import Thesis

HASH = '0123456789abcdef' * 4
PHI, GAIN = 'simulator.inclination_deg', 'ankle_controller.gain'
CELL = {
    'runs': 3,
    'up': 2,
    'lost': 1,
    'slipped': 1,
    'fell_at_s': None,
    'vibration_rad_s': 0.125,
    'largest_slip_m': 0.02,
}
BEST = ({PHI: 5.0, GAIN: 15.0, **CELL},)


def soles(phi, smooth, rubber):
    """Return the record of an inclination with the tallies of both soles."""
    pairs = (('smooth', smooth), ('rubber', rubber))
    return {PHI: phi, **{f'{name}_{sole}': of[name] for sole, of in pairs for name in CELL}}


SOLES = MapResult(
    'simulator.friction',
    soles=(soles(5.0, CELL, CELL), soles(7.0, CELL, dict.fromkeys(CELL))),
    limits=(
        {'value': 0.18, 'deg': 7.0, 'low_deg': 6.5, 'high_deg': None},
        {'value': 0.8, 'deg': None, 'low_deg': None, 'high_deg': None},
    ),
)
EMPTY = Findings(None, (), (), (), [], [], {}, 0, 0, 0.0, True, 'khr reproduce --fast', {})


def figure(folder, number, experiments=(), error=''):
    folder.mkdir(parents=True, exist_ok=True)
    image, points = folder / f'{number}.png', folder / f'{number}.csv'
    if not error:
        picture = Figure(figsize=(1.0, 1.0))
        picture.text(0.1, 0.5, number)
        picture.savefig(image)
        points.write_text(f'panel,{number}\n')
    return FigureResult(
        number,
        f'The picture of {number}',
        image,
        points,
        f'khr figure {number}',
        experiments,
        error,
    )


TIMES = count(1.0, 0.125)  # no two runs take as long


def run(name, seed, verdict='walked', slip=0.01, **changes):
    scenario = load_scenario(name).changed(
        {tuple(key.split('__')): value for key, value in changes.items()}
    )
    row = {
        'verdict': verdict,
        'stayed_up': verdict != 'fell' and slip <= RIDES,
        'fell_at_s': 4.25 if verdict == 'fell' else None,
        'time_s': 13.6,
        'largest_slip_m': slip,
        'vibration_rad_s': 0.1,
        'trajectory_hash': f'{HASH}{seed}',
        'wall_time_s': next(TIMES),
        'error': None,
    }
    return Run({'scenario': name, **changes}, seed, row, scenario, Path('absent'))


def findings(bench=None, **changes):
    made = {
        'scoreboard': compare(bench or Thesis()),
        'peaks': [
            {
                'frequency': 2.58,
                'gains': 'K_A 12',
                'verdict': 'gait line 6: the gait',
                'sure': 'high',
            }
        ],
        'maps': {'map_a': MapResult(GAIN, BEST, (9.0,)), 'map_b': SOLES},
        'figures': 3,
        'runs': 2,
        'run_seconds': 754.0,
        'fast': False,
        'command': 'khr reproduce',
        'versions': {'code': 'abcdef', 'numpy': '2.0'},
    }
    return replace(EMPTY, **(made | changes))


def reproduction(folder, bench=None, **changes):
    made = {
        'figures': [
            figure(folder / 'figures', '3.8'),
            figure(folder / 'elsewhere', '5.9', ('a',)),
            figure(folder, 'friction'),
            figure(folder, '4.4', error='the <circuit> does not converge'),
        ],
        'maps': [figure(folder / 'figures', 'map_a'), figure(folder / 'figures', 'map_b')],
        'runs': {'a': [run('walk_3deg', 0), run('walk_3deg', 1, 'fell')]},
        'seeds': {'a': 2},
        'seconds': 754.0,
        'findings': findings(bench),
        'peaks': None,
    }
    return Reproduction(**(made | changes))
