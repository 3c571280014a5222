"""What a controller of this repository touches: counted, against what docs/extending.md says."""

import re

from tests import ROOT

WHERE = ('src', 'config', 'docs', 'tests/unit/khr_balance')


def stated():
    """Return the files in the table of the document."""
    text = (ROOT / 'docs' / 'extending.md').read_text(encoding='utf-8')
    table = text.partition('Those of the roll controller:')[2].partition('\n## ')[0]
    rows = [line for line in table.splitlines() if line.startswith('| `')]
    return {name for row in rows for name in re.findall('`([^`]+)`', row.split('|')[1])}


def naming(*words):
    """Return the files that name one of some words in their text or are named so."""
    files = [each for place in WHERE for each in (ROOT / place).rglob('*') if each.is_file()]
    files += [each for each in ROOT.iterdir() if each.is_file()]
    found = set()
    for path in {each.resolve() for each in files if 'egg-info' not in str(each)}:
        if path.suffix in ('.pyc', '.png', '.gif') or path.name == 'extending.md':
            continue
        if any(word in path.read_text(encoding='utf-8', errors='ignore') for word in words):
            found.add(path.relative_to(ROOT.resolve()).as_posix())
    return found


def test_a_controller_touches_the_six_files_that_the_document_lists():
    assert naming('roll_controller', 'ROLL_CONTROLLER') == stated()
    assert len(stated()) == 6
