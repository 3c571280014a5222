"""The parts of the thesis that ``khr reproduce`` computes."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common.checks import one_of
from khr_common.errors import KhrError
from khr_sim.physics import engines
from khr_studies.measuring.experiments import experiment_files
from khr_studies.thesis_figures.registry import FIGURES

SCOREBOARD = 'scoreboard'
MAP = 'map_'  # prefix of the experiments that are drawn as stability maps


@dataclass(frozen=True)
class ExperimentPlan:
    """The parts of a reproduction."""

    figures: tuple[str, ...]  # numbers of the figures, in the order of the registry
    maps: tuple[str, ...]  # names of experiments that are drawn as stability maps
    scoreboard: bool  # whether the scoreboard is measured
    fast: bool  # whether to compute the quick and coarse form
    command: str  # the command with the same plan
    engine: str = engines.DEFAULT  # physics engine

    @property
    def experiments(self) -> tuple[str, ...]:
        """Return the names of all required experiments, without repetition."""
        of_figures = (name for number in self.figures for name in FIGURES[number].experiments)
        return tuple(dict.fromkeys((*of_figures, *self.maps)))


def parse_plan(only: str | None, fast: bool, engine: str = engines.DEFAULT) -> ExperimentPlan:
    """Parse the names of parts, separated by commas; None stands for everything."""
    maps = [name for name in experiment_files() if name.startswith(MAP)]
    every = (*FIGURES, *maps, SCOREBOARD)
    names = every if only is None else tuple(name.strip() for name in only.split(','))
    for name in names:
        if name not in every:
            raise KhrError(f'--only: {name!r} is not known; accepted: {", ".join(every)}')
    one_of('--engine', engine, [*engines.LIBRARIES])
    return ExperimentPlan(
        tuple(number for number in FIGURES if number in names),
        tuple(name for name in maps if name in names),
        SCOREBOARD in names,
        fast,
        'khr reproduce'
        + (f' --only {only}' if only else '')
        + ' --fast' * fast
        + engine_option(engine),
        engine,
    )


def engine_option(engine: str) -> str:
    """Return the option of a command for a physics engine; empty for the default one."""
    return f' --engine {engine}' if engine != engines.DEFAULT else ''
