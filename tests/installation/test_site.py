"""The documents become pages without a warning: no link leads nowhere, no name is unknown."""

import subprocess
import sys

import pytest

from tests import ROOT


@pytest.mark.slow
def test_every_document_becomes_a_page(tmp_path):
    built = subprocess.run(
        [sys.executable, '-m', 'sphinx', '-q', '-W', '--keep-going', '-c', 'docs', '-d',
         tmp_path / 'trees', '.', tmp_path / 'site'],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    pages = {path.stem for path in (tmp_path / 'site').rglob('*.html')}
    assert pages >= {path.stem for path in (ROOT / 'docs').glob('*.md')} | {'README', 'api'}
    assert 'README.html' in (tmp_path / 'site' / 'index.html').read_text()
    api = (tmp_path / 'site' / 'docs' / 'api.html').read_text()
    for name in ('run', 'load', 'spectrum', 'critical', 'sweep', 'env'):
        assert f'id="khr.{name}"' in api
