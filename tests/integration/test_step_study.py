"""The size of the physics step does not decide a limit."""

from dataclasses import replace

import pytest

from khr_studies.engines.study import ENGINES, STEPS, STUDIED, with_engine
from khr_studies.measuring.bench import Bench
from khr_sweeps.pool import local_pool

SEEDS, TOLERANCE, MOST = 3, 0.1, 0.2  # the last two in deg


@pytest.mark.nightly
@pytest.mark.timeout(900)
@pytest.mark.parametrize('engine', ENGINES)
def test_half_the_step_moves_no_limit(engine):
    """Single seeds move by what their last bisections scatter; the mean of some stays."""
    with local_pool(2) as pool:
        bench = Bench(pool, SEEDS, TOLERANCE)
        coarse, fine = (
            bench.limit(replace(STUDIED, changes=with_engine(engine, changes)))
            for changes in ((), STEPS['step 0.5 ms'])
        )
    assert fine.mean == pytest.approx(coarse.mean, abs=MOST)
    assert 6.0 < coarse.mean < 10.0  # a search that found nothing would agree as well
