"""The command line: mistakes are one line on stderr and exit code 2, and start nothing."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from importlib.metadata import version
from math import degrees
from pathlib import Path

import pytest

from khr.cli import command
from khr.cli.verbs.bouts import start_bout
from khr.cli.verbs.runs import start_run
from khr_bringup.launching import split_changes
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.robots import on_robot
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from tests.support.runs import KHR

ASCII = {'LC_ALL': 'C', 'PYTHONUTF8': '0', 'PYTHONCOERCECLOCALE': '0'}


def khr(monkeypatch, capsys, *arguments):
    monkeypatch.setattr('sys.argv', ['khr', *map(str, arguments)])
    with pytest.raises(SystemExit) as leave:
        command.main()
    captured = capsys.readouterr()
    return leave.value.code, captured.out, captured.err


@pytest.mark.parametrize(
    ('arguments', 'says'),
    [
        (['run', 'nowhere.yaml'], ['nowhere.yaml', 'no such scenario', 'khr scenarios']),
        (['view', 'nowhere'], ['nowhere: no such run or scenario', 'khr scenarios']),
        (['run', 'walk_0deg', '--expect', 'flown'], ['flown', 'walked | stood']),
        (['run', 'walk_0deg', '--expect', 'realtime'], ['--expect', 'sync=realtime']),
        (['run', 'walk_0deg', '--offline', '--view'], ['--view: ', '--offline']),
        (['run', 'walk_0deg', '--offline', '--network'], ['--network: ', '--offline']),
        (['verify', 'nowhere'], ['nowhere: not there', 'folder of a run']),
        (['get', 'gait', '--timeout', '0'], ['--timeout', '0.1', 'khr get --help']),
        (['run', 'walk_0deg', '--domain', '900'], ['--domain', '900', '1 to 99']),
        (
            ['reproduce', '--only', '3.8,9.9'],
            ['--only', '9.9', '3.8', 'map_walk_ka', 'scoreboard'],
        ),
        (['run', 'walk_0deg', '--board', ''], ["--board: '' is not accepted", 'no --board']),
        (['run', 'walk_0deg', '--expect='], ["--expect: '' is not accepted"]),
        (['run', ''], ["run: '' is not accepted"]),
        (['run', 'walk_0deg', '--fly'], ['--fly', 'khr run --help']),
        (['run', 'walk_0deg', 'walk_3deg'], ['walk_3deg', 'khr run --help']),
        (['fly'], ['fly', 'khr --help']),
        (['report', 'last'], ['last: no run', 'folder of a run']),
        (['run', '.'], ['.: a folder, no file', 'khr scenarios']),
        (['run', 'walk_0deg', '--set', 'gait.cycels=3'], ['did you mean cycles?']),
        (['run', 'walk_0deg', '--set', 'ankle_controler.gain=3'], ['did you mean ankle_contr']),
        (['run', 'walk_0deg', '--set', 'gain=3'], ['ankle_controller.gain or hip_controller.g']),
        (['run', 'walk_0deg', '--offline', '--ka', '-1'], ['ankle_controller: gain: ']),
        (['view', 'walk_0deg', '--no-browser', '--kh', 'nan'], ['hip_controller: gain: ']),
        (['view', 'stand_0deg', '--no-browser', '--port', '99999'], ['--port: ']),
        (['view', '.', '--no-browser', '--kh', '0'], ['--kh: not accepted with a recording']),
        (['report', '.', '--out', 'x.docx'], ['--out', 'x.docx', '.html']),
        (['figure', '3.8', '--out', 'x.doc'], ['--out', 'x.doc', 'a folder, or a name in .png']),
        (['report', '.', '--axis', 'x', '--out', 'x.svg'], ['--axis: not accepted with --out']),
        (
            ['export', 'stand_0deg', '--motion', '--out', 'x.csv', '--namespace', '/a'],
            ['--namespace: stand_0deg has no bag'],
        ),
        (['view', '.', '--no-browser', '--no-record'], ['--no-record: not accepted with a rec']),
        (['fights', '--measured', '--out', 'f.csv'], ["--out: 'f.csv' is not acc", 'name in .md']),
        (['fights', '--measured', '--bouts', '3'], ['--bouts: not accepted with --measured']),
        (['stage3', '--measured', '--seeds', '3'], ['--seeds: not accepted with --measured']),
        (['stage3', '--measured', '--engine', 'bullet'], ['--engine: not accepted with']),
        (
            ['reproduce', '--out', 'report', '--findings', 'report/scoreboard.md'],
            ['--findings: not accepted as report/scoreboard.md'],
        ),
        (['critical', '--set', 'hip_controller.enabled=true'], ['enabled=True', '--kh']),
        (['lines', '--out', '.'], ["--out: '.' is a folder", 'name in .md']),
        (['critical', '--out', 'limit.txt'], ["--out: 'limit.txt'", 'name in .csv or .json']),
        (
            ['calibrate', '--out', 'a.md', '--members', 'a.json'],
            ["--members: 'a.json' would be overwritten"],
        ),
        (['push', '--recovery', '--measured', '--out', 'new'], ['new/recovery.csv']),
        (
            ['push', '--direction', 'front,front'],
            ["--direction: 'front,front'", 'each value once'],
        ),
        (['push', '--ka', '0,0.0'], ["--ka: '0,0.0' is not accepted", 'each value once']),
        (['scoreboard', '--tolerance', 'nan'], ['--tolerance: nan is not', '[0.01, 0.8] deg']),
        (['engines', '--tolerance', '0', '--out', 'x/e.md'], ['--tolerance: 0 is not accepted']),
        (['critical', '--set', 'gait.motion=stand'], ['gait.motion=stand', '--walk or --stand']),
        *(
            (['board', 'serve', 'stand_0deg', '--link', 'rcb4', option, value], [option, bound])
            for option, value, bound in (
                ('--duration', '-1', '0'),
                ('--byte-us', 'nan', '0'),
                ('--priority', '500', '99'),
            )
        ),
    ],
)
def test_mistakes(monkeypatch, capsys, tmp_path, arguments, says):
    monkeypatch.chdir(tmp_path)
    code, out, err = khr(monkeypatch, capsys, *arguments)
    assert code == 2
    assert out == ''
    lines = [line for line in err.strip().splitlines() if line.startswith('khr: ')]
    assert len(lines) == 1
    for word in says:
        assert word in lines[0]
    assert not list(tmp_path.iterdir())


def test_a_run_of_nothing_lists_the_scenarios(monkeypatch, capsys):
    code, out, err = khr(monkeypatch, capsys, 'run')
    assert code == 2 and 'walk_7.68deg_ka12' in out
    assert err == 'khr: run: no scenario given; accepted: one of these, or a scenario file\n'


@pytest.mark.parametrize('closed', ['>&-', '2>&-', '<&-', '<&- >&- 2>&-'])
def test_a_closed_stream_is_no_error(tmp_path, closed):
    words = f'{shlex.join(KHR)} run stand_0deg --offline --duration 0.1 --out run {closed}'
    done = subprocess.run(words, shell=True, cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b'')


def test_a_middleware_that_is_not_installed_is_refused_before_rclpy_ends_the_process(tmp_path):
    def scenarios_with(**given):
        return subprocess.run(
            [*KHR, 'scenarios'], check=False, capture_output=True, text=True,
            env={**os.environ, 'RMW_IMPLEMENTATION': 'rmw_other_cpp', **given},
        )  # fmt: skip

    refused = scenarios_with()
    assert refused.returncode == 2 and refused.stderr.count('\n') == 1
    assert "RMW_IMPLEMENTATION: 'rmw_other_cpp' is not installed; accepted: " in refused.stderr
    assert scenarios_with(RMW_IMPLEMENTATION='').returncode == 0
    (tmp_path / 'lib').mkdir()
    (tmp_path / 'lib' / 'librmw_other_cpp.so').touch()
    other = f'/none:{tmp_path}'
    assert 'is not installed' in scenarios_with(AMENT_PREFIX_PATH=other).stderr, 'of another rclpy'
    own = scenarios_with(AMENT_PREFIX_PATH=f'{other}:{sys.prefix}')
    assert 'is not installed' not in own.stderr


def test_without_a_verb_there_is_help(monkeypatch, capsys):
    code, out, err = khr(monkeypatch, capsys)
    assert (code, err) == (2, '') and 'The real robot' in out


def test_the_version_is_that_of_the_package(monkeypatch, capsys):
    assert khr(monkeypatch, capsys, '--version')[:2] == (0, f'khr {version("khr")}\n')


def test_the_shell_completes_scenarios():
    ended = subprocess.run(
        ['khr'], executable=Path(sys.executable).with_name('khr'), capture_output=True, text=True,
        check=False, env={**os.environ, '_KHR_COMPLETE': 'complete_bash',
                          'COMP_WORDS': 'khr run walk_7', 'COMP_CWORD': '2'},
    )  # fmt: skip
    assert ended.stdout.split() == ['walk_7.68deg_ka12'], ended.stderr


def test_a_run_says_what_was_run_and_whether_it_is_what_was_expected(
    monkeypatch, capsys, tmp_path
):
    monkeypatch.setenv('COLUMNS', '80')
    folder = tmp_path / ('a[b]' * 20)
    title = f'{scenarios.load_scenario("stand_0deg").title}, simulator.friction=0.3'
    words = ['run', 'stand_0deg', '--offline', '--duration', 0.3, '--out', folder]
    words += ['--set', 'simulator.friction=0.3', '--expect', 'fell']
    code, out, err = khr(monkeypatch, capsys, *words)
    assert code == 1 and 'expected fell, the outcome is stood' in err
    assert (folder / 'scenario.yaml').read_text().startswith(f'# {title}\n')
    lines = out.splitlines()
    outcome = json.loads((folder / 'outcome.json').read_text())
    rows = dict(cells for line in lines if len(cells := re.findall('│ (.*?) +(?=│)', line)) == 2)
    assert rows['vibration, deg/s'] == f'{degrees(outcome["vibration_rad_s"]):.2f}'
    assert float(rows['judged until, s']) == outcome['time_s']
    assert lines[0] == title and lines[-2] == f'folder {folder}'
    assert lines[-1].startswith('trajectory hash ')


def test_a_gain_of_a_controller_that_is_off_is_pointed_out(monkeypatch, capsys):
    settings = '--set', 'hip_controller.gain=13', '--set', 'hip_controller.staged=false'
    warning = (
        'khr: --set hip_controller.gain, staged: no effect while hip_controller.enabled is '
        'false; to switch it on: --set hip_controller.enabled=true\n'
    )
    for verb in ('run', 'view'):
        monkeypatch.setattr(f'khr.cli.run.{verb}_scenario', lambda *_: 0)
        words = verb, 'walk_8.88deg_ka12', *settings
        assert khr(monkeypatch, capsys, *words)[2] == warning
        assert khr(monkeypatch, capsys, *words, '--kh', '13')[2] == ''


@pytest.mark.parametrize(
    ('source', 'start'),
    [('walk_0deg', 'khr.cli.run.view_scenario'), ('shove', 'khr.cli.verbs.bouts.view_bout')],
)
def test_a_stated_change_wins_over_the_pace_of_a_view(monkeypatch, capsys, source, start):
    started = []
    monkeypatch.setattr(start, lambda viewed, *_: started.append(viewed) or 0)
    stated = ('--set', 'simulator.pace=3.0')
    for words in (), ('--pace', '2'), stated, (*stated, '--pace', '2'):
        assert khr(monkeypatch, capsys, 'view', source, *words)[0] == 0
    shown = [getattr(each, 'robots', {'red': each})['red'] for each in started]
    assert [each.of('simulator')['pace'] for each in shown] == [1.0, 2.0, 3.0, 2.0]


@pytest.mark.parametrize(
    ('body', 'code', 'says'),
    [
        (f'import os\nos.kill(os.getpid(), {int(signal.SIGTERM)})\n', 130, 'khr: interrupted\n'),
        ('raise MemoryError', 1, 'khr: out of memory; accepted: a larger limit (ulimit -v)\n'),
        ('raise ImportError("lib\\nx")', 1, 'khr: ImportError: lib x\n'),
    ],
)
def test_what_goes_wrong_in_the_imports_is_one_line(tmp_path, body, code, says):
    (tmp_path / 'typer.py').write_text(body)
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(tmp_path), *sys.path])}
    done = subprocess.run(
        [sys.executable, '-m', 'khr.cli.command', 'scenarios'],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, '', says)


LATE = """
import os, sys
from khr.cli import command

class Late:
    def __del__(self, kill=os.kill, process=os.getpid()):
        kill(process, {number})

sys.late = Late()  # deleted when the interpreter has restored the default actions of signals
sys.argv = ['khr', '--version']
command.main()
"""
VERB = """
import sys
from khr.cli import command
from khr.cli.verbs import runs

def verb():
    exec('import os; os.kill(os.getpid(), {number}); [None for _ in range(10**6)]')

runs.list_scenarios = verb
sys.argv = ['khr', 'scenarios']
command.main()
"""
INTERRUPTED = b'khr: interrupted\n'


@pytest.mark.parametrize(
    ('script', 'number', 'code', 'says'),
    [
        (LATE, signal.SIGTERM, 0, b''),
        (VERB, signal.SIGINT, 130, INTERRUPTED),
        (VERB, signal.SIGTERM, 130, INTERRUPTED),
    ],
)
def test_a_signal_at_the_end_keeps_the_exit_code_and_one_in_a_verb_is_a_line(
    tmp_path, script, number, code, says
):
    """At the end of the interpreter, or within an exec of an import."""
    (tmp_path / 'script.py').write_text(script.format(number=int(number)))
    words = [sys.executable, '-m', 'script']
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (code, says)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('words', 'locale'),
    [
        (['run', 'stand_0deg', '--offline', '--out', b'a\xff'], {}),
        (['run', 'stand_0deg', '--out', 'aü'], ASCII),
        (['report', b'a\xff'], {}),
    ],
)
def test_a_path_of_other_bytes_is_refused_in_one_line(tmp_path, words, locale):
    done = subprocess.run(
        [sys.executable, '-m', 'khr.cli.command', *words],
        capture_output=True,
        cwd=tmp_path,
        env={**os.environ, **locale},
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, b''), done.stderr
    assert done.stderr.startswith(b'khr: ') and done.stderr.count(b'\n') == 1
    assert not list(tmp_path.iterdir())


def test_a_file_that_fails_is_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(scenarios, 'load_scenario', lambda _: (tmp_path / 'gone').read_text())
    code, out, err = khr(monkeypatch, capsys, 'run', 'walk_0deg')
    assert (code, out) == (2, '')
    assert err == f"khr: '{tmp_path / 'gone'}': No such file or directory\n"


def test_scenarios_lists_all(monkeypatch, capsys):
    monkeypatch.setenv('COLUMNS', '80')
    code, out, _ = khr(monkeypatch, capsys, 'scenarios')
    assert code == 0
    for name in ('lift_3.8deg', 'push_behind', 'walk_9.7deg_ka12_kh12_rubber'):
        assert name in out


@pytest.mark.slow
def test_gains_and_engine_have_options_and_last_is_the_newest_run(monkeypatch, capsys, tmp_path):
    def real(*words):
        return khr(monkeypatch, capsys, *words)[0]

    monkeypatch.chdir(tmp_path)
    words = ['run', 'stand_0deg', '--duration', '0.3', '--no-draw', '--ka', '18', '--kh', '0']
    done = subprocess.run([*KHR, *words, '--engine', 'mujoco'], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    (folder,) = (tmp_path / 'runs').iterdir()
    text = (folder / 'scenario.yaml').read_text()
    assert 'gain: 18.0' in text and 'engine: mujoco' in text
    assert real('export', 'last', '--out', 'run.csv') == 0
    head, *rows = (tmp_path / 'run.csv').read_text().splitlines()
    assert len(rows) == 21
    for name in ('time, s', 'pitch, deg', 'joints_l_knee, deg', 'balance_capture, m'):
        assert f'"{name}"' in head
    assert real('export', 'last', '--out', 'run.txt') == 2
    assert real('report', 'last', '--out', 'charts.pdf') == 0
    assert (tmp_path / 'charts.pdf').read_bytes().startswith(b'%PDF')
    assert real('report', 'last', '--against', 'last', '--out', 'both.pdf') == 2
    assert not (tmp_path / 'both.pdf').exists()
    sources = {'a': 'last', 'b': 'stand_0deg', 'c': folder / 'bag' / 'bag.mcap'}
    for name, of in sources.items():
        assert real('export', str(of), '--motion', '--out', f'{name}.csv') == 0
    frames = [(tmp_path / f'{name}.csv').read_text() for name in sources]
    assert frames[0] == frames[1] == frames[2] and frames[0].startswith('time_s,com_x_m')


def test_the_command_of_ros2_has_gains_engine_robot_and_folder(capsys):
    asked = {'ka': 18.0, 'engine': 'mujoco', 'robot': 'leaning', 'out': 'a folder'}
    start_run('lift_2.7deg', print_ros2=True, **asked)
    *launch, scenario, changes, out = shlex.split(capsys.readouterr().out)
    assert launch == ['ros2', 'launch', 'khr_bringup', 'balance.launch.py']
    assert (scenario, out) == ('scenario:=lift_2.7deg', 'out:=a folder')
    settings = split_changes(changes.removeprefix('set:='))
    launched = load_scenario('lift_2.7deg').set_to(settings)
    meant = on_robot(load_scenario('lift_2.7deg'), 'leaning').set_to(
        ['ankle_controller.gain=18.0', 'ankle_controller.enabled=true', 'simulator.engine=mujoco']
    )
    assert launched.values == meant.values


@pytest.mark.parametrize(('start', 'name'), [(start_run, 'walk_0deg'), (start_bout, 'shove')])
def test_an_option_that_the_command_of_ros2_cannot_carry_is_refused(start, name):
    with pytest.raises(KhrError, match=r'^--domain: not with --print-ros2'):
        start(name, print_ros2=True, domain=3)
