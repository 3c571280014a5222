"""``khr tune``: the answer as a scenario file, a page and a picture of the trade-off."""

from __future__ import annotations

from collections.abc import Callable
from math import degrees, inf
from pathlib import Path

import yaml

from khr_bringup.scenario import ANYWHERE, Scenario, load
from khr_common import RunError
from khr_common.files import write_text
from khr_experiments.critical import LARGEST_JOBS
from khr_experiments.ensemble_file import read_ensemble
from khr_figures.plot_style import save
from khr_figures.tuning import front_picture, values_text
from khr_report.page.document import Block, Columns, Passage, markdown, table
from khr_report.page.text import count
from khr_tuning.errors import TuningError
from khr_tuning.knobs import GAINS, PLACEMENT
from khr_tuning.tune import ORDERS, Question, Tuned, Tuning, tune

ROOT = Path('runs/tune')


def write(
    scenario: str,
    changed: list[str],
    gait: bool,
    robust: bool,
    seeds: int,
    candidates: int,
    seed: int,
    jobs: int,
    out: Path | None,
) -> str:
    """Search, write scenario, page and picture into a folder, and return what was found.

    Args:
        scenario: file or name.
        changed: parameters to change first, ``node.parameter=value``.
        gait: whether the gait's placement of the centre of mass is searched as well.
        robust: whether the gains are to hold for the robots of the ensemble.
        seeds: runs of each candidate and robot.
        candidates: how many to try.
        seed: of the optimiser.
        jobs: processes.
        out: folder; ``runs/tune/NAME`` if left out.

    Raises:
        KhrError: if an argument is not accepted.
        RunError, OSError: if no gains hold the robot, or a file cannot be written.
    """
    if not 1 <= jobs <= LARGEST_JOBS:
        raise TuningError(
            f'--jobs: {jobs} is not accepted; accepted: integer in [1, {LARGEST_JOBS}]'
        )
    asked = load(scenario).set_to(changed)
    robots = tuple(read_ensemble()) if robust else ()
    if robust and not robots:
        raise TuningError('--robust: the ensemble has no robot; accepted: after khr calibrate')
    knobs = (*GAINS, *(PLACEMENT if gait else ()))
    question = Question(asked, knobs, robots, seeds, candidates, seed)
    folder = out or ROOT / (asked.name + ('_robust' if robust else ''))
    answer = tune(question, jobs, folder / 'jobs')
    return render(answer, folder)


def render(answer: Tuning, folder: Path) -> str:
    """Write the files of an answer; return a summary.

    Raises:
        RunError: if no candidate stayed up in any run, so that there is nothing to write.
    """
    if answer.best.survived == 0.0:
        raise RunError(
            f'{answer.question.scenario.name}: none of {len(answer.tried)} candidates stays up '
            f'(the longest: {values_text(answer.question.knobs, answer.best.values)}, '
            f'{answer.best.lasted:.0%} of the run); accepted: gentler ground, --gait, or more '
            '--candidates'
        )
    folder.mkdir(parents=True, exist_ok=True)
    name = f'{answer.question.scenario.name}_tuned'
    write_text(folder / f'{name}.yaml', scenario_text(answer))
    figure = front_picture(answer)
    save(figure, folder / 'front.png')
    write_text(folder / 'tune.md', markdown([*blocks(answer)], 1) + '\n')
    knobs = answer.question.knobs
    before = f'before, {values_text(knobs, answer.before.values)}: {_words(answer.before)}'
    return (
        f'{values_text(knobs, answer.best.values)}: {_words(answer.best)}; with other seeds '
        f'{_words(answer.confirmed)}\n{_nothing_better(answer) or before}\n{folder / f"{name}.yaml"}'
    )


def scenario_text(answer: Tuning) -> str:
    """Return the tuned scenario as the text of its file, thin over the defaults."""
    tuned: Scenario = answer.scenario
    document = {
        ANYWHERE + node: {'ros__parameters': keys} for node, keys in tuned.values.items() if keys
    }
    title = f'{tuned.title or tuned.name}; tuned: '
    found = values_text(answer.question.knobs, answer.best.values)
    return f'# {title}{found}\n' + yaml.safe_dump(document, sort_keys=False)


def _nothing_better(answer: Tuning) -> str:
    """Say that a search has found nothing, if so."""
    if answer.best != answer.before:
        return ''
    others = count(len(answer.tried) - 1, 'other candidate')
    return f"None of {others} is better than the scenario's own values."


def _words(each: Tuned) -> str:
    if each.slip == inf:
        return f'{each.survived:.0%} up'
    return (
        f'{each.survived:.0%} up, slip {1e3 * each.slip:.0f} mm, '
        f'vibration {degrees(each.vibration):.1f} deg/s'
    )


def _value(index: int) -> Callable[[tuple[str, Tuned]], str]:
    return lambda row: f'{row[1].values[index]:g}'


def blocks(answer: Tuning) -> list[Block]:
    """Return the page."""
    question = answer.question
    robots = f'{len(question.robots)} robots of the ensemble' if question.robots else 'the robot'
    rows = [('as it was', answer.before), ('chosen', answer.best)]
    rows += [('chosen, other seeds', answer.confirmed)]
    rows += [('front', each) for each in answer.front if each != answer.best]
    columns: Columns[tuple[str, Tuned]] = {
        '': lambda row: row[0],
        **{knob.symbol: _value(index) for index, knob in enumerate(question.knobs)},
        'up': lambda row: f'{row[1].survived:.0%}',
        'slip, mm': lambda row: '-' if row[1].slip == inf else f'{1e3 * row[1].slip:.1f}',
        'vibration, deg/s': lambda row: (
            '-' if row[1].vibration == inf else f'{degrees(row[1].vibration):.2f}'
        ),
    }
    text = (
        f'Written by `khr tune`. {len(answer.tried)} candidates, each with '
        f'{count(question.seeds, "seed")} on {robots}; searched twice (CMA-ES), with {" and with ".join(ORDERS)} first. The order: '
        'most seeds up, then least slip, then least vibration. Slip and vibration are medians over '
        'the runs without a fall, of the worst robot. *Front*: what no candidate with as many seeds '
        'up beats in both.' + f' {_nothing_better(answer)}'.rstrip()
    )
    return [
        Passage(
            f'Gains for {question.scenario.name}',
            (text, '![Slip against vibration](front.png)', table(rows, columns)),
        )
    ]
