"""The calibration: its search, its files, and that the defaults hold what it found."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.node_registry import table_of
from khr_common import RunError, check, specifications
from khr_experiments.calibrate import (
    FittedConstant,
    boundary,
    calibrate,
    differences,
    fit_constant,
)
from khr_experiments.calibration import CONSTANTS, FITS
from khr_experiments.errors import ExperimentError
from khr_report.calibration_page import constants_file, page
from tests import ROOT

DOCS = ROOT / 'docs'
FIT = replace(FITS[0], low=0.0, high=1.0)


@given(limit=st.floats(0.01, 0.99), falls_above=st.booleans())
def test_boundary_is_found_whichever_end_survives(limit, falls_above):
    found = boundary(lambda value: (value < limit) == falls_above, FIT)
    assert found == pytest.approx(limit, abs=1.0 / 64.0)


@pytest.mark.parametrize('survives', [True, False])
def test_row_that_no_value_meets_is_an_error(survives):
    with pytest.raises(RunError, match=f'{FIT.node}.{FIT.key}'):
        boundary(lambda _: survives, FIT)


class Alone:
    """A pool of one process: this one."""

    map = staticmethod(map)


@pytest.mark.parametrize('falls_above', [True, False])
def test_every_seed_survives_with_the_constant(monkeypatch, falls_above):
    """Seed 1 also falls on an island near the boundary that the halving does not meet."""
    fit = replace(FIT, decimals=2)

    def attempt(condition, inclination_deg, seed):
        value = dict(condition.changes)[fit.node, fit.key]
        value = value if falls_above else 1.0 - value
        island = seed == 1 and 0.575 < value < 0.593
        return SimpleNamespace(survived=value < 0.6 and not island, text='')

    monkeypatch.setattr('khr_experiments.calibrate.attempt', attempt)
    found = fit_constant(fit, {}, range(3), Alone())
    chosen = replace(fit.rows[0].condition, changes=(((fit.node, fit.key), found.value),))
    assert all(attempt(chosen, 0.0, seed).survived for seed in range(3))
    assert found.value == pytest.approx(0.57 if falls_above else 0.43)


def test_few_constants_are_fitted_each_once_and_none_per_scenario():
    names = [(fit.node, fit.key) for fit in FITS]
    assert len(names) == len(set(names)) <= 5
    assert not {(c.node, c.key) for c in CONSTANTS} & set(names)
    for fit in FITS:
        assert not any(row.condition.changes for row in fit.rows)
        for value in (fit.low, fit.high):
            check(table_of(fit.node), fit.key, value)


def test_every_constant_is_a_parameter_with_a_known_provenance():
    for constant in CONSTANTS:
        assert constant.key in specifications(table_of(constant.node))
        assert constant.kind in ('measured', 'published', 'derived', 'assumed')


def test_files_hold_what_was_found():
    found = [FittedConstant(fit, (fit.low, fit.high), fit.low) for fit in FITS]
    fitted = yaml.safe_load(constants_file(found))
    text = page(found, 7, 2)
    for one in found:
        assert fitted[one.fit.node]['ros__parameters'][one.fit.key] == one.value
        assert f'`{one.fit.node}.{one.fit.key}` | {one.value:g}' in text
    assert len(differences(fitted)) == len(FITS), 'no default is an end of its range'
    assert 'khr calibrate --seed 7 --seeds 2' in text


def test_defaults_are_the_fitted_constants():
    fitted = yaml.safe_load((DOCS / 'calibration.yaml').read_text())
    assert differences(fitted) == []
    assert sum(len(body['ros__parameters']) for body in fitted.values()) == len(FITS)


@pytest.mark.parametrize(
    ('seed', 'seeds', 'jobs', 'word'),
    [(0, 1, 1, '--seeds'), (-1, 2, 1, '--seed'), (0, 2, 0, '--jobs')],
)
def test_arguments_are_refused(seed, seeds, jobs, word):
    with pytest.raises(ExperimentError, match=word):
        calibrate(seed, seeds, jobs)
