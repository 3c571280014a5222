"""The tuned gains as a scenario file, a page and a picture of the trade-off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import degrees, isfinite
from pathlib import Path

import pandas as pd

from khr_common import RunError
from khr_common.files import write_text
from khr_report.page.document import Columns, count, page_text, table
from khr_report.plots.plot_style import save
from khr_studies.tuning.figure import front_picture, values_text
from khr_studies.tuning.study import Tuning


def write(answer: Tuning, folder: Path) -> str:
    """Write scenario, page and picture of an answer into a folder; return a summary.

    Raises:
        RunError: if no candidate stayed up in any run; nothing is written then.
    """
    axes, best, before = answer.question.axes, answer.best, answer.before
    if best['up'] == 0.0:
        raise RunError(
            f'{answer.question.scenario.name}: none of {len(answer.tried)} candidates stays up '
            f'(the longest: {values_text(axes, best)}, {best["lasted"]:.0%} of the run); accepted: '
            'a gentler slope, --gait, or more --candidates'
        )
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f'{answer.question.scenario.name}_tuned.yaml'
    write_text(file, scenario_text(answer))
    save(front_picture(answer), folder / 'front.png')
    write_text(folder / 'tune.md', page(answer))
    unchanged = f'before, {values_text(axes, before)}: {_words(before)}'
    return (
        f'{values_text(axes, best)}: {_words(best)}; with other seeds {_words(answer.confirmed)}\n'
        f'{_nothing_better(answer) or unchanged}\n{file}'
    )


def scenario_text(answer: Tuning) -> str:
    """Return the text of the tuned scenario's file; it holds changes of the defaults alone."""
    tuned, found = answer.scenario, values_text(answer.question.axes, answer.best)
    stated = {node: keys for node, keys in tuned.values.items() if keys}
    title = f'{tuned.title or tuned.name}; tuned: {found}'
    return replace(tuned, title=title, values=stated).stated_to_yaml()


def _nothing_better(answer: Tuning) -> str:
    """Return a sentence if the search has found nothing better, else an empty text."""
    if answer.best.name != answer.before.name:
        return ''
    others = count(len(answer.tried) - 1, 'other candidate')
    return f"None of {others} is better than the scenario's own values."


def _words(row: pd.Series) -> str:
    if not isfinite(row['slip_m']):
        return f'{row["up"]:.0%} up'
    return (
        f'{row["up"]:.0%} up, slip {1e3 * row["slip_m"]:.1f} mm, '
        f'vibration {degrees(row["vibration_rad_s"]):.1f} deg/s'
    )


def page(answer: Tuning) -> str:
    """Return the page."""
    question = answer.question
    several = len(question.robots)
    robots = f'{count(several, "robot")} of the ensemble' if several else 'the robot'
    orders = [order for order, generations in question.generations.items() if generations]
    rows = [('before', answer.before), ('chosen', answer.best)]
    rows += [('chosen, other seeds', answer.confirmed)]
    rows += [('front', row) for name, row in answer.front.iterrows() if name != answer.best.name]
    columns: Columns[tuple[str, pd.Series]] = {
        '': lambda row: row[0],
        **{axis.symbol: _value(axis.name) for axis in question.axes},
        'up': lambda row: f'{row[1]["up"]:.0%}',
        'slip, mm': lambda row: _finite(1e3 * row[1]['slip_m'], 1),
        'vibration, deg/s': lambda row: _finite(degrees(row[1]['vibration_rad_s']), 2),
    }
    return page_text(
        __name__,
        answer=answer,
        question=question,
        seeds=count(question.seeds, 'seed'),
        robots=robots,
        orders=orders,
        worst=', of the worst robot' if several > 1 else '',
        nothing_better=_nothing_better(answer),
        candidates=table(rows, columns),
    )


def _value(name: str) -> Callable[[tuple[str, pd.Series]], str]:
    return lambda row: f'{row[1][name]:g}'


def _finite(value: float, decimals: int) -> str:
    return f'{value:.{decimals}f}' if isfinite(value) else '-'
