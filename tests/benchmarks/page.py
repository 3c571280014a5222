"""The page of all benchmarks: ratios of speeds beside their goals, then everything measured."""

import statistics
from pathlib import Path
from typing import NamedTuple

from khr_common.text.markdown import table
from tests.benchmarks import commands, environments, graphs
from tests.benchmarks.board import FIGURES
from tests.benchmarks.clock import CLOCKS, COMPUTING, WALL

TEMPLATE = Path(__file__).with_name('performance.md')
REACHED = 0.9  # of its bound: the goal of a ratio whose bound is too low for its own goal
MOST_LATE = 1.0  # % of the periods on a board


class Goal(NamedTuple):
    """The least ratio of the speeds of two cases of a part."""

    part: str
    name: str
    base: str
    least: float
    clock: str = WALL


GOALS = (
    Goal('graphs', graphs.TWIN, graphs.RAW, 0.85),
    Goal('graphs', graphs.TWIN, graphs.RAW, 0.85, COMPUTING),
    Goal('graphs', graphs.TWIN, graphs.MOTORS, 0.85),
    Goal('graphs', graphs.MUJOCO_TWIN, graphs.TWIN, 3.0),
    Goal('graphs', graphs.MUJOCO_TWIN, graphs.TWIN, 3.0, COMPUTING),
    Goal('graphs', graphs.ONE, graphs.TWIN, 0.8),
    Goal('graphs', graphs.ONE_RECORDED, graphs.ONE, 0.85),
    Goal('graphs', graphs.EACH, graphs.TWIN, 0.6),
    Goal('graphs', graphs.EACH_RECORDED, graphs.EACH, 0.85),
    Goal('swept', commands.TWO, commands.ONE, 1.8),
    Goal('swept', commands.MUJOCO, commands.TWO, 3.0),
    Goal('swept', commands.ONE, commands.PLACE, 0.97),
    *(
        Goal('environments', f'{name}, {engine}', f'{base}, {engine}', least, clock)
        for engine in environments.ENGINES
        for name, base, least, clock in (
            (environments.ALONE, environments.TWIN, 0.95, COMPUTING),
            (environments.EACH, environments.ALONE, 0.9, WALL),
        )
    ),
)


def page(data):
    """Return the results of all parts, by part, as Markdown."""
    bounds = bounds_of(data)
    return TEMPLATE.read_text(encoding='utf-8').format(
        scenario=graphs.SCENARIO,
        seconds=graphs.SECONDS,
        rounds=len(data['graphs']),
        reached=REACHED,
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
            [_goal(goal, data[goal.part], bounds) for goal in GOALS],
        ),
        bounds=table(
            ('speed of', 'against', 'goal set', 'bound', 'what is left'),
            [
                (goal.name, goal.base, f'{goal.least:.0%}', f'{most:.0%}', left)
                for goal in GOALS
                if goal.clock == WALL and (goal.name, goal.base) in bounds
                for most, left in [bounds[goal.name, goal.base]]
            ],
        ),
        messages=_messages(data['messages']),
        speeds=table(
            ('case', 'least', 'median', 'most'),
            [
                (
                    case,
                    *(
                        f'{value:.2f}'
                        for value in spread(run[case][WALL] for run in data['graphs'])
                    ),
                )
                for case in data['graphs'][0]
            ],
        ),
        graphs='\n'.join(_graphs(data['graphs'])),
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
                (f'`{name}`', f'{most:.0f}', f'{took:.0f}', _met(took <= most))
                for name, (most, _) in commands.COMMANDS.items()
                for took in [data['commands'][name]]
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


def bounds_of(data):
    """Return the largest possible value of ratios and what it leaves of a run, by both names."""
    runs, messages, rounds = data['graphs'], data['messages'], data['environments']
    left = 'its steps: calls of PyBullet, contacts, servos, joint states; nothing once a period'
    most = median(runs, graphs.STEPS) / median(runs, graphs.RAW)
    found = {(graphs.TWIN, graphs.RAW): (most, left)}
    took = {case: 1.0 / median(messages, case) for case in messages[0]}
    for plain, recorded, where in (
        (graphs.ONE, graphs.ONE_RECORDED, 'in one process'),
        (graphs.EACH, graphs.EACH_RECORDED, 'from process to process'),
    ):
        left = f'the twin, spectra and frames, and the messages, filled in and parsed, {where}'
        found[plain, graphs.TWIN] = took[graphs.TWIN] / took[plain], left
        own = 1.0 / median(runs, plain)
        left = 'the run, and a recorder that only writes its messages'
        found[recorded, plain] = own / (own + took[recorded] - took[plain]), left
    for engine in environments.ENGINES:
        each, alone, apart = (
            f'{case}, {engine}'
            for case in (environments.EACH, environments.ALONE, environments.APART)
        )
        most = statistics.median(run[apart][WALL] / run[alone][WALL] for run in rounds)
        found[each, alone] = most, 'as many independent processes, the slowest in each step'
    return found


def _goal(goal, rounds, bounds):
    """Return the row of a goal, which is lowered if its bound is lower."""
    most, _ = bounds.get((goal.name, goal.base), (float('inf'), ''))
    least, clock = min(goal.least, REACHED * most), 'wall' if goal.clock == WALL else 'computing'
    found = spread(run[goal.name][goal.clock] / run[goal.base][goal.clock] for run in rounds)
    shown = (f'{ratio:.0%}' for ratio in (least, *found))
    return goal.name, goal.base, clock, *shown, _met(found[1] >= least)


def _met(is_met):
    return 'met' if is_met else '**missed**'


def _messages(rounds):
    def added(case):
        return statistics.median(
            1.0 / run[case][WALL] - 1.0 / run[graphs.TWIN][WALL] for run in rounds
        )

    return ', '.join(
        f'{case} {1e6 * environments.PERIOD * added(case):.0f} us'
        for case in rounds[0]
        if case != graphs.TWIN
    )


def _graphs(rounds):
    for case, first in rounds[0].items():
        rest = [f'{key} {median(rounds, case, key):.2f}' for key in first if key not in CLOCKS]
        if rest:
            yield f'- {case}: {", ".join(rest)}'


def _board(found):
    def middle(runs, figure):
        return statistics.median(float(run.get(figure, 'nan')) for run in runs)

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
