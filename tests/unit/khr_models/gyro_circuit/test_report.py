from khr_models.gyro_circuit.report import PART
from tests import ROOT

DOCUMENT = ROOT / 'docs' / 'gyro.md'


def test_the_document_is_up_to_date():
    text = DOCUMENT.read_text(encoding='utf-8')
    assert PART.rewrite(text) == text, 'run: python -m khr_models.gyro_circuit.report docs/gyro.md'
