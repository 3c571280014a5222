"""The tuned gains as a scenario file, a page and a picture of the trade-off."""

from __future__ import annotations

from collections.abc import Callable
from math import degrees, inf
from pathlib import Path

import yaml

from khr_bringup.scenario.scenario import ANYWHERE, Scenario
from khr_common import RunError
from khr_common.files import write_text
from khr_report.page.document import Columns, table
from khr_report.page.template import page_text
from khr_report.page.text import count
from khr_report.plots.plot_style import save
from khr_studies.tuning.figure import front_picture, values_text
from khr_studies.tuning.study import ORDERS, Tuned, Tuning


def write(answer: Tuning, folder: Path) -> str:
    """Write scenario, page and picture of an answer into a folder; return what was found.

    Raises:
        RunError: if no candidate stayed up in any run, so that there is nothing to write.
        KhrError, OSError: if a file cannot be written.
    """
    knobs = answer.question.knobs
    best = values_text(knobs, answer.best.values)
    if answer.best.up == 0.0:
        raise RunError(
            f'{answer.question.scenario.name}: none of {len(answer.tried)} candidates stays up '
            f'(the longest: {best}, {answer.best.lasted:.0%} of the run); accepted: gentler '
            'ground, --gait, or more --candidates'
        )
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f'{answer.question.scenario.name}_tuned.yaml'
    write_text(file, scenario_text(answer))
    save(front_picture(answer), folder / 'front.png')
    write_text(folder / 'tune.md', page(answer))
    before = f'before, {values_text(knobs, answer.before.values)}: {_words(answer.before)}'
    return (
        f'{best}: {_words(answer.best)}; with other seeds {_words(answer.confirmed)}\n'
        f'{_nothing_better(answer) or before}\n{file}'
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
        return f'{each.up:.0%} up'
    return (
        f'{each.up:.0%} up, slip {1e3 * each.slip:.0f} mm, '
        f'vibration {degrees(each.vibration):.1f} deg/s'
    )


def _value(index: int) -> Callable[[tuple[str, Tuned]], str]:
    return lambda row: f'{row[1].values[index]:g}'


def page(answer: Tuning) -> str:
    """Return the page."""
    question = answer.question
    robots = f'{len(question.robots)} robots of the ensemble' if question.robots else 'the robot'
    rows = [('as it was', answer.before), ('chosen', answer.best)]
    rows += [('chosen, other seeds', answer.confirmed)]
    rows += [('front', each) for each in answer.front if each != answer.best]
    columns: Columns[tuple[str, Tuned]] = {
        '': lambda row: row[0],
        **{knob.symbol: _value(index) for index, knob in enumerate(question.knobs)},
        'up': lambda row: f'{row[1].up:.0%}',
        'slip, mm': lambda row: '-' if row[1].slip == inf else f'{1e3 * row[1].slip:.1f}',
        'vibration, deg/s': lambda row: (
            '-' if row[1].vibration == inf else f'{degrees(row[1].vibration):.2f}'
        ),
    }
    return page_text(
        __name__,
        answer=answer,
        question=question,
        seeds=count(question.seeds, 'seed'),
        robots=robots,
        orders=ORDERS,
        nothing_better=_nothing_better(answer),
        candidates=table(rows, columns),
    )
