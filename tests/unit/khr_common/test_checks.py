import math

import numpy as np
import pytest

from khr_common import KhrError, checks

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ('check', 'bounds', 'accepted', 'refused', 'text'),
    [
        (checks.positive, (), [1e-300, 2.0], [0.0, -1.0, INF, NAN], r'(0, inf)'),
        (checks.non_negative, (), [0.0, 2.0], [-1e-300, INF, NAN], r'[0, inf)'),
        (checks.finite, (), [-1e300, 0.0], [INF, -INF, NAN], r'(-inf, inf)'),
        (checks.between, (1, 2, 'Hz'), [1.5], [1, 2, NAN], r'(1, 2) Hz'),
        (checks.integer, (1, 3), [1, 3], [0, 4], r'integer in [1, 3]'),
        (checks.one_of, (('a', 'b'),), ['a'], ['c', 1], r'a | b'),
        (
            checks.within,
            (-1, 1),
            [1.0, np.array([-1.0, 0.0])],
            [NAN, 1.1, np.array([0.0, -1.1])],
            r'[-1, 1]',
        ),
    ],
)
def test_a_check_refuses_what_is_outside_and_says_what_is_accepted(
    check, bounds, accepted, refused, text
):
    for value in accepted:
        check('size', value, *bounds)
    for value in refused:
        with pytest.raises(KhrError, match=r'^size: ') as refusal:
            check('size', value, *bounds)
        assert str(refusal.value).endswith(f'is not accepted; accepted: {text}')
