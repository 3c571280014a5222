"""The optimiser: seeded, within its range, and at home in one dimension as well as in many."""

import pytest

from khr_studies.measuring.optimiser import evolution


@pytest.mark.parametrize('dimensions', [1, 8])
def test_it_finds_a_corner_of_its_range_again_and_again(dimensions):
    found = []
    for _ in range(2):
        optimiser = evolution([0.5] * dimensions, 0.3, 1, 8)
        for _ in range(40):
            shares = optimiser.ask()
            assert all(0.0 <= share <= 1.0 for each in shares for share in each)
            optimiser.tell(shares, [sum(each) for each in shares])
        found.append(min(sum(each) for each in shares) / dimensions)
    assert found[0] == found[1] < 0.02
