import pytest

from khr_common import KhrError
from khr_sim.gyro_circuit.report import rewrite
from tests import ROOT

DOCUMENT = ROOT / 'docs' / 'gyro.md'


def test_the_document_is_up_to_date():
    text = DOCUMENT.read_text(encoding='utf-8')
    assert rewrite(text) == text, 'run: python -m khr_sim.gyro_circuit.report docs/gyro.md'


def test_a_document_without_markers_is_refused():
    with pytest.raises(KhrError, match=r'^text: no markers'):
        rewrite('# Gyro')
