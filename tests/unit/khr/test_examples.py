"""Every function of the Python interface has an example, and it does what it says."""

import doctest
import os
import sys
from pathlib import Path

import pytest

import khr

PUBLIC = {name: getattr(khr, name) for name in khr.__all__ if name != 'KhrError'} | {
    'RunResult.table': khr.RunResult.table,
    'RunResult.plot': khr.RunResult.plot,
}
SLOW = ('critical', 'load', 'stage3', 'sweep', 'tune')  # other processes do the work


@pytest.mark.parametrize(
    'name', [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in PUBLIC]
)
def test_an_example_does_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('PATH', f'{Path(sys.executable).parent}:{os.environ["PATH"]}')
    (found,) = doctest.DocTestFinder(recurse=False).find(PUBLIC[name], name, globs={})
    assert found.examples, f'khr.{name} has no example'
    said = []
    doctest.DocTestRunner().run(found, out=said.append)
    assert not said, ''.join(said)
