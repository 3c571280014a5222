"""What is installed is what was locked: every requirement has digests, and they are required."""

import re

import pytest

from tests import ROOT

PIP = re.compile(
    r'^(?:\t|RUN | +command = ).*(?:pip install|\$\(INSTALL\)|PIP, .install.).*$', re.MULTILINE
)


@pytest.mark.parametrize('name', ['requirements.lock', 'requirements-dev.lock'])
def test_every_requirement_is_of_one_version_and_has_a_digest(name):
    lines = (ROOT / name).read_text().replace('\\\n', ' ').splitlines()
    found = [line for line in lines if line.strip() and not line.lstrip().startswith('#')]
    assert len(found) > 20
    for line in found:
        assert re.match(r'[\w.\[\]-]+==\S+ .*--hash=sha256:[0-9a-f]{64}\b', line), line[:80]


@pytest.mark.parametrize('name', ['Makefile', 'Dockerfile', '.ci/install'])
def test_what_is_fetched_is_fetched_by_its_digest(name):
    found = PIP.findall((ROOT / name).read_text())
    assert any('--require-hashes' in line for line in found)
    for line in found:  # what is built of these sources has none; arguments are the Makefile's
        assert '--require-hashes' in line or '--no-deps' in line or 'sys.argv' in line, line
