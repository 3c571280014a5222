"""Whatever is installed is checked against the digests of the lock files."""

import re

import pytest

from tests import ROOT

PIP = re.compile(
    r'^(?:\t|RUN | +command = ).*(?:pip install|\$\(INSTALL\)|PIP, .install.).*$', re.MULTILINE
)


@pytest.mark.parametrize('name', ['Makefile', 'Dockerfile', '.ci/install'])
def test_what_is_fetched_is_fetched_by_its_digest(name):
    found = PIP.findall((ROOT / name).read_text())
    assert any('--require-hashes' in line for line in found)
    for line in found:  # what is built of these sources has none; arguments are the Makefile's
        assert '--require-hashes' in line or '--no-deps' in line or 'sys.argv' in line, line
