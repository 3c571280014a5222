"""Documents do what they say: every command and script in them is run, in order, and says that.

Commands of all documents, also those amid the text, have verbs and options that there are; and all
documents become pages.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from khr.cli.app import app
from tests import ROOT
from tests.support.runs import wait_for, wait_until_running

DOCUMENTS = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'docs').glob('*.md'))]
BLOCK = re.compile(r'(?:`(\S+\.yaml)`[^\n]*\n)?^```(\w+)\n(.*?)^```', re.MULTILINE | re.DOTALL)
SECOND = '# second terminal'
REFUSED = '# refused'
# What takes minutes is run with less: the last of an option counts. What is printed then, and by
# what is measured against the wall clock, has other numbers than the document.
LESS = {
    'khr run walk_8.88deg_ka12 --out': '--duration 5',
    'khr verify': '',
    'khr run stand_0deg --realtime': '',
    'khr critical': '--seeds 1 --tolerance 0.8 --set simulator.engine=mujoco',
    'khr tune': '--candidates 8 --seeds 1 --set simulator.engine=mujoco',
    'khr film runs/without --against runs/with --start': '--rate 5',
    'khr lines walk': '--set simulator.engine=mujoco',
    'khr reproduce': '--only 3.8',
}
ASKED = set()


def commands_of(text):
    """Return the commands of a block, without comments."""
    lines = (line.partition('#')[0].strip() for line in text.replace('\\\n', ' ').splitlines())
    return [line for line in lines if line]


def less_of(command):
    """Return what a command is run with to take less; None if it is run as it stands."""
    return next((less for start, less in LESS.items() if command.startswith(start)), None)


def missing(shown, printed, numbers):
    """Return the lines of a document that no printed line is like: ``...`` is any text.

    Args:
        shown: the block of the document.
        printed: what its commands printed.
        numbers: whether numbers are compared.
    """
    lines = [_plain(line, numbers) for line in printed.splitlines()]
    patterns = [
        re.escape(_plain(line, numbers)).replace(r'\.\.\.', '.*') for line in shown.splitlines()
    ]
    return [each for each in patterns if not any(re.fullmatch(each, line) for line in lines)]


def _plain(line, numbers):
    """Return a line without the width of its table and, if need be, without numbers."""
    line = re.sub('real time .*', 'real time', ' '.join(line.replace('│', ' ').split()))
    return line if numbers else re.sub(r'\d+(\.\d+)?', '0', line)


class Reader:
    """Someone who does in a folder what a document says."""

    def __init__(self, folder):
        self.folder = folder
        (folder / 'config').symlink_to(ROOT / 'config')
        paths = f'{Path(sys.executable).parent}:{os.environ["PATH"]}'
        self.environment = os.environ | {'PATH': paths, 'BROWSER': 'true', 'COLUMNS': '120'}
        self.scripts = ''  # one session of Python, run when all else is there
        self.started = 0

    def start(self, command):
        """Start a command; what it says is in the file ``said``."""
        self.started += 1
        said = self.folder / f'said-{self.started}.txt'
        with said.open('w') as file:
            process = subprocess.Popen(
                shlex.split(command), cwd=self.folder, env=self.environment,
                stdout=file, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        process.said = said
        return process

    def end(self, process, *codes, interrupt=True):
        if interrupt:
            process.send_signal(signal.SIGINT)
        process.wait(timeout=300)
        assert process.returncode in codes, f'{process.args}\n{process.said.read_text()}'
        return process.said.read_text()

    def run(self, command, *codes):
        if command.startswith('khr critical') and command in ASKED:
            return ''  # another document asks the same, and it leaves nothing
        ASKED.add(command)
        return self.end(self.start(f'{command} {less_of(command) or ""}'), *codes, interrupt=False)

    def look(self, command):
        """Open a page, see that it is served, and leave."""
        process = self.start(command)

        def served():
            assert process.poll() is None, process.said.read_text()
            return re.search(r'http://\S+', process.said.read_text())

        wait_for(served, 'the page')
        return self.end(process, 0, 130)  # the second if the run had not begun yet

    def follow(self, text):
        """Do what all blocks of a document say; what it shows of their output, they print."""
        blocks = [match.groups() for match in BLOCK.finditer(text)]
        other, printed, numbers = None, '', True
        for (file, kind, body), after in zip(blocks, [*blocks[1:], ('', '', '')], strict=True):
            if kind == 'python':
                self.scripts += body
            elif kind == 'yaml':
                (self.folder / file).write_text(body)
            elif kind == 'text':
                assert not missing(body, printed, numbers), printed
            elif after[2].startswith(SECOND):
                (command,) = commands_of(body)
                other = self.start(command)
                wait_until_running(Path(command.split('--out ')[1]))
            else:
                assert kind == 'sh'
                printed = ''.join(self.do(line) for line in body.splitlines())
                if body.startswith(SECOND):
                    printed += self.end(other, 130)
                numbers = all(less_of(each) is None for each in commands_of(body)) and not other
                other = None
        (self.folder / 'session.py').write_text(self.scripts)
        self.run(f'{sys.executable} session.py', 0)

    def do(self, line):
        """Do a line of a block; return what it prints."""
        shown = ''
        for command in commands_of(line):
            if command.startswith('khr view') or '--view' in command:
                shown += self.look(command)
            else:
                shown += self.run(command, 2 if REFUSED in line else 0)
        return shown


@pytest.mark.nightly
@pytest.mark.timeout(900)
@pytest.mark.parametrize('name', ['tutorial', 'tuning'])
def test_a_reader_gets_through(name, tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))  # the runs of other tests are not seen
    monkeypatch.chdir(tmp_path)
    reader = Reader(tmp_path)
    reader.follow((ROOT / 'docs' / f'{name}.md').read_text())
    promised = {
        'tutorial': ['runs/with/overview.png', 'runs/with/report.html', 'runs/both.gif',
                     'runs/without/film.png', 'report/index.html'],
        'tuning': ['runs/new/report.html', 'runs/tune/walk_6.99deg_ka12/walk_6.99deg_ka12_tuned.yaml'],
    }  # fmt: skip
    for path in promised[name]:
        assert (tmp_path / path).is_file(), path


@pytest.mark.nightly
def test_a_reader_sees_what_the_document_of_the_page_says(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    monkeypatch.chdir(tmp_path)
    reader = Reader(tmp_path)
    for name in ('RUN', 'OTHER'):
        reader.run(f'khr run stand_0deg --duration 1 --out runs/{name}', 0)
    shown, _ = (
        body for _, kind, body in BLOCK.findall((ROOT / 'docs' / 'view.md').read_text())
    )  # the other one is for two machines
    for line in shown.splitlines():
        reader.do(line)


def spoken(text):
    """Return the khr commands of a document, in blocks and amid the text."""
    blocks = [
        line for _, kind, body in BLOCK.findall(text) if kind == 'sh' for line in commands_of(body)
    ]
    spans = re.findall(
        r'`([^`\n]*(?:\n[^`\n]+)?)`', re.sub(r'```.*?```', '', text, flags=re.DOTALL)
    )
    words = (shlex.split(' '.join(each.split()).partition('#')[0], posix=False) for each in [*blocks, *spans]
             if re.match(r'(\.venv/bin/)?khr\s', each))  # fmt: skip
    return [each[1:] for each in words]


@pytest.mark.parametrize('path', DOCUMENTS, ids=lambda path: path.name)
def test_verbs_and_options_are_those_of_the_command(path):
    verbs = get_command(app()).commands
    for verb, *words in spoken(path.read_text()):
        if verb == 'VERB' or verb.startswith('-'):
            continue
        assert verb in verbs, verb
        command = verbs[verb]
        if hasattr(command, 'commands') and words:  # a verb of verbs
            verb, command = f'{verb} {words[0]}', command.commands[words[0]]
        known = {name for each in command.params for name in (*each.opts, *each.secondary_opts)}
        asked = {word.partition('=')[0] for word in words if word.startswith('--')}
        assert asked <= known | {'--help'}, f'khr {verb}'


@pytest.mark.nightly
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
