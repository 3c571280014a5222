"""The servos' law is kept compiled, as it is; what has changed since is compiled anew."""

import numpy as np

from khr_sim import compiled
from khr_sim.servo import CONSTANTS, SHAPE, law


def summed(rows, constants):
    """Add up the columns of a table, into its first row."""
    for i in range(rows.shape[1]):
        total = constants[0]
        for row in range(rows.shape[0]):
            total += rows[row, i]
        rows[0, i] = total


def test_what_is_kept_was_made_of_the_present_law():
    kept = compiled._place(law).read_text()
    renew = 'the law has changed since: python -m tests.golden.servo_law'
    assert kept.startswith(compiled._heading(law, (SHAPE, CONSTANTS))), renew


def test_it_was_made_of_the_rows_of_the_table_too(monkeypatch):
    kept = compiled._heading(law, (SHAPE, CONSTANTS))
    monkeypatch.setattr('khr_sim.servo.GOAL', 5)
    assert compiled._heading(law, (SHAPE, CONSTANTS)) != kept


def test_a_function_of_which_nothing_is_kept_is_compiled():
    rows, constants = np.arange(12.0).reshape(3, 4), np.array([0.5])
    add = compiled.bound(summed, rows, constants)
    expected = rows.sum(axis=0) + 0.5
    add()
    assert (rows[0] == expected).all() and (rows[1:] == [[4, 5, 6, 7], [8, 9, 10, 11]]).all()
    constants[0] = 0.0
    add()
    assert (rows[0] == expected + rows[1] + rows[2]).all()
