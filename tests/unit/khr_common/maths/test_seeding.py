"""Random numbers: by seed and name, and by nothing else."""

from hypothesis import given
from hypothesis import strategies as st

from khr_common.maths.seeding import generator

SEEDS, NAMES = st.integers(0, 2**40), st.text('abcdefgh_', min_size=1, max_size=12)


@given(SEEDS, NAMES)
def test_the_same_again(seed, name):
    assert generator(seed, name).normal(size=4).tolist() == (
        generator(seed, name).normal(size=4).tolist()
    )


@given(SEEDS, NAMES, SEEDS, NAMES)
def test_another_seed_or_name_draws_otherwise(seed, name, other_seed, other_name):
    if (seed, name) != (other_seed, other_name):
        assert generator(seed, name).random() != generator(other_seed, other_name).random()
