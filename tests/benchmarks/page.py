"""The page of all benchmarks: ratios of speeds beside their goals, then everything measured."""

import statistics
from pathlib import Path

from khr_common.markdown import table
from tests.benchmarks import commands, environments, graphs
from tests.benchmarks.board import FIGURES
from tests.benchmarks.clock import COMPUTING, WALL

TEMPLATE = Path(__file__).with_name('performance.md')
CLOCKS = {WALL: 'wall', COMPUTING: 'computing'}
MOST_LATE = 1.0  # % of the periods on a board
# Part, two of its cases, the least ratio of their speeds, and by which clock.
GOALS = (
    ('graphs', graphs.TWIN, graphs.RAW, 0.7, WALL),
    ('graphs', graphs.TWIN, graphs.RAW, 0.7, COMPUTING),
    ('graphs', graphs.TWIN, graphs.MOTORS, 0.85, WALL),
    ('graphs', graphs.MUJOCO_TWIN, graphs.TWIN, 3.0, WALL),
    ('graphs', graphs.MUJOCO_TWIN, graphs.TWIN, 3.0, COMPUTING),
    ('graphs', graphs.ONE, graphs.TWIN, 0.7, WALL),
    ('graphs', graphs.ONE_RECORDED, graphs.ONE, 0.8, WALL),
    ('graphs', graphs.EACH, graphs.TWIN, 0.6, WALL),
    ('graphs', graphs.EACH_RECORDED, graphs.EACH, 0.8, WALL),
    ('graphs_mujoco', graphs.MUJOCO_ONE, graphs.MUJOCO_ALONE, 0.48, WALL),
    ('graphs_mujoco', graphs.MUJOCO_ONE_RECORDED, graphs.MUJOCO_ONE, 0.85, WALL),
    ('graphs_mujoco', graphs.MUJOCO_EACH, graphs.MUJOCO_ALONE, 0.32, WALL),
    ('graphs_mujoco', graphs.MUJOCO_EACH_RECORDED, graphs.MUJOCO_EACH, 0.85, WALL),
    ('swept', commands.TWO, commands.ONE, 1.8, WALL),
    ('swept', commands.MUJOCO, commands.TWO, 3.0, WALL),
    ('swept', commands.ONE, commands.PLACE, 0.97, WALL),
    *(
        ('environments', f'{name}, {engine}', f'{base}, {engine}', least, clock)
        for engine in environments.ENGINES
        for name, base, least, clock in (
            (environments.ALONE, environments.TWIN, 0.95, COMPUTING),
            (environments.EACH, environments.ALONE, 0.9, WALL),
        )
    ),
)


def page(data):
    """Return the results of all parts, by part, as Markdown."""
    both = data['graphs'], data['graphs_mujoco']
    return TEMPLATE.read_text(encoding='utf-8').format(
        scenario=graphs.SCENARIO,
        seconds=graphs.SECONDS,
        rounds=len(data['graphs']),
        sweep_seconds=commands.SECONDS,
        few=commands.FEW,
        many=commands.MANY,
        starts=', '.join(
            f'{case} {median(data["swept"], case, "start_s"):.1f} s'
            for case in data['swept'][0]
            if 'start_s' in data['swept'][0][case]
        ),
        goals=table(
            ('speed of', 'against', 'clock', 'goal', 'least', 'median', 'most', ''),
            [_goal(data[part], *goal) for part, *goal in GOALS],
        ),
        speeds=table(
            ('case', 'least', 'median', 'most'),
            [
                (case, *(f'{value:.2f}' for value in spread(run[case][WALL] for run in rounds)))
                for rounds in both
                for case in rounds[0]
            ],
        ),
        graphs='\n'.join(line for rounds in both for line in _graphs(rounds)),
        board=_board(data['board']),
        period=table(
            ('engine', 'part', 'us', 'share'),
            [
                (engine, part, f'{value:.0f}', f'{value / sum(parts.values()):.0%}')
                for engine, parts in data['period'].items()
                for part, value in parts.items()
            ],
        ),
        environments=_environments(data['environments']),
        growth=table(
            ('engine', 'until, s', 'ms per simulated s', 'MiB'),
            [
                (engine, *(f'{value:.1f}' for value in part.values()))
                for engine, parts in data['growth'].items()
                for part in parts
            ],
        ),
        commands=table(
            ('command', 'goal, s', 'measured, s', ''),
            [
                (
                    f'`{name}`',
                    f'{most:.0f}',
                    f'{data["commands"][name]:.0f}',
                    _met(data['commands'][name] <= most),
                )
                for name, (most, _) in commands.COMMANDS.items()
            ],
        ),
    )


def median(rounds, case, key=WALL):
    """Return the median of a number of a case over the rounds that have it."""
    return statistics.median(run[case][key] for run in rounds if key in run[case])


def spread(values):
    """Return minimum, median and maximum."""
    values = list(values)
    return min(values), statistics.median(values), max(values)


def _goal(rounds, name, base, least, clock):
    """Return the row of a goal."""
    found = spread(run[name][clock] / run[base][clock] for run in rounds)
    shown = (f'{ratio:.0%}' for ratio in (least, *found))
    return name, base, CLOCKS[clock], *shown, _met(found[1] >= least)


def _met(is_met):
    return 'met' if is_met else '**missed**'


def _graphs(rounds):
    for case, first in rounds[0].items():
        rest = [f'{key} {median(rounds, case, key):.2f}' for key in first if key not in CLOCKS]
        if rest:
            yield f'- {case}: {", ".join(rest)}'


def _board(found):
    def middle(runs, figure):
        return statistics.median(run[figure] for run in runs)

    rows = [
        (
            name,
            mode,
            *(' '.join(sorted({run[which] for run in runs})) for which in ('robot', 'twin')),
            _met(all(run['robot'] == run['twin'] for run in runs)),
            f'{middle(runs, "late"):.1f} % of {middle(runs, "periods"):.0f}',
            _met(middle(runs, 'late') <= MOST_LATE),
            *(f'{middle(runs, figure):.2f}' for figure in FIGURES),
            f'{middle(runs, "others"):.1f}',
        )
        for name, modes in found.items()
        for mode, runs in modes.items()
    ]
    head = ('scenario', 'nodes', 'robot', 'twin', "goal: the twin's verdict", 'late')
    figures = (figure.removesuffix('_ms').replace('_', ' ') for figure in FIGURES)
    return table((*head, f'goal: {MOST_LATE:g} % at most', *figures, 'others'), rows)


def _environments(rounds):
    def rate(case, clock):
        if clock not in rounds[0][case]:
            return '-'
        return f'{median(rounds, case, clock) / environments.PERIOD:.0f}'

    head = ('case', 'control periods per s of computing', 'per s')
    return table(head, [(case, rate(case, COMPUTING), rate(case, WALL)) for case in rounds[0]])
