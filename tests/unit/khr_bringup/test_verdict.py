"""What a launched round says at its end."""

from khr_analysis.referee import Decision
from khr_bringup.verdict import text_of


def test_a_draw_is_not_won():
    assert text_of(Decision('draw', 'time limit', 30.0)) == 'draw, time limit, 30.00 s'
    assert text_of(Decision('red', 'blue down', 0.24)) == 'won by red, blue down, 0.24 s'
