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
from khr.cli.verbs.options import ros2_command, settings_text
from khr.cli.verbs.runs import start_run
from khr_bringup.launching import split_changes
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.robots import on_robot
from khr_bringup.scenario.scenario import load_scenario
from khr_common import RunError
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
        *(
            (['run', 'walk_0deg', '--offline', *words], [f'{words[0]}: ', '--offline'])
            for words in (['--realtime'], ['--view'], ['--network'])
        ),
        (['verify', 'nowhere'], ['nowhere: not there', 'folder of a run']),
        (['get', 'gait', '--timeout', '0'], ['--timeout', '0.1', 'khr get --help']),
        (['run', 'walk_0deg', '--domain', '900'], ['--domain', '900', '1 to 99']),
        (
            ['reproduce', '--only', '3.8,9.9'],
            ['--only', '9.9', '3.8', 'map_walk_ka', 'scoreboard'],
        ),
        (['run', 'walk_0deg', '--fly'], ['--fly', 'khr run --help']),
        (['run', 'walk_0deg', 'walk_3deg'], ['walk_3deg', 'khr run --help']),
        (['fly'], ['fly', 'khr --help']),
        (['report', 'last'], ['last: no run', 'folder of a run']),
        (['lines', 'last'], ['last: no run', 'folder of a run']),
        (['run', '.'], ['.: a folder, no file', 'khr scenarios']),
        (['run', 'walk_0deg', '--set', 'gait.cycels=3'], ['did you mean cycles?']),
        (['run', 'walk_0deg', '--set', 'ankle_controler.gain=3'], ['did you mean ankle_contr']),
        (
            ['run', 'walk_0deg', '--set', 'gain=3'],
            ['ankle_controller.gain or hip_controller.gain'],
        ),
        *(
            (['board', 'serve', 'stand_0deg', '--link', 'rcb4', option, value], [option, bound])
            for option, value, bound in (
                ('--duration', '-1', '0'),
                ('--duration', 'nan', '0'),
                ('--reply-ms', '-5', '0'),
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
    assert not (tmp_path / 'runs').exists()


def test_lines_look_at_the_folder_of_their_page_before_they_run_anything(
    monkeypatch, capsys, tmp_path
):
    def never(*_, **__):
        raise AssertionError('ran')

    monkeypatch.setattr('khr_studies.peak_origin.study.run_variants', never)
    (tmp_path / 'file').touch()
    code, _, err = khr(monkeypatch, capsys, 'lines', '--out', tmp_path / 'file' / 'x.md')
    assert code == 2 and err.startswith('khr: --out: ') and err.count('\n') == 1


@pytest.mark.parametrize(('option', 'value'), [('--ka', '-1'), ('--ka', 'nan'), ('--kh', '-12')])
def test_a_gain_that_is_none_does_not_switch_the_control_off(
    monkeypatch, capsys, tmp_path, option, value
):
    monkeypatch.chdir(tmp_path)
    for verb in (['run', '--offline'], ['view', '--no-browser']):
        code, _, err = khr(monkeypatch, capsys, verb[0], 'walk_0deg', *verb[1:], option, value)
        assert code == 2 and 'controller: gain: ' in err and err.count('\n') == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    'words',
    [
        ['--ka', '12'],
        ['--kh', '0'],
        ['--set', 'gait.cycles=3'],
        ['--robot', 'leaning'],
        ['--engine', 'mujoco'],
        ['--duration', '3'],
        ['--pace', '2'],
        ['--no-record'],
        ['--out', 'there'],
        ['--domain', '7'],
    ],
)
def test_an_option_of_a_run_is_refused_with_a_recording(monkeypatch, capsys, tmp_path, words):
    code, _, err = khr(monkeypatch, capsys, 'view', tmp_path, '--no-browser', *words)
    said = f'khr: {words[0]}: not accepted with a recording; accepted: a scenario\n'
    assert (code, err) == (2, said)


def test_a_run_of_nothing_lists_the_scenarios(monkeypatch, capsys):
    code, out, err = khr(monkeypatch, capsys, 'run')
    assert code == 2 and 'walk_7.68deg_ka12' in out
    assert err == 'khr: run: no scenario given; accepted: one of these, or a scenario file\n'


def test_the_version_is_that_of_the_package(monkeypatch, capsys):
    assert khr(monkeypatch, capsys, '--version')[:2] == (0, f'khr {version("khr")}\n')


def test_the_shell_completes_scenarios():
    ended = subprocess.run(
        ['khr'], executable=Path(sys.executable).with_name('khr'), capture_output=True, text=True,
        check=False, env={**os.environ, '_KHR_COMPLETE': 'complete_bash',
                          'COMP_WORDS': 'khr run walk_7', 'COMP_CWORD': '2'},
    )  # fmt: skip
    assert ended.stdout.split() == ['walk_7.68deg_ka12'], ended.stderr


def test_expectation_that_fails_is_exit_code_1(monkeypatch, capsys, tmp_path):
    code, out, err = khr(
        monkeypatch,
        capsys,
        'run',
        'stand_0deg',
        '--offline',
        '--duration',
        '0.3',
        '--out',
        tmp_path / 'run',
        '--expect',
        'fell',
    )
    assert code == 1
    assert 'expected fell, the outcome is stood' in err
    assert out.strip().splitlines()[-1].startswith('trajectory hash ')


def test_a_run_says_what_was_run(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv('COLUMNS', '80')
    folder = tmp_path / ('a[b]' * 20)
    title = f'{scenarios.load_scenario("stand_0deg").title}, simulator.friction=0.3'
    command_line = ['run', 'stand_0deg', '--set', 'simulator.friction=0.3']
    code, out, _ = khr(
        monkeypatch, capsys, *command_line, '--offline', '--duration', 0.3, '--out', folder
    )
    assert code == 0
    assert (folder / 'scenario.yaml').read_text().startswith(f'# {title}\n')
    lines = out.splitlines()
    outcome = json.loads((folder / 'outcome.json').read_text())
    rows = dict(cells for line in lines if len(cells := re.findall('│ (.*?) +(?=│)', line)) == 2)
    assert rows['vibration, deg/s'] == f'{degrees(outcome["vibration_rad_s"]):.2f}'
    assert float(rows['judged until, s']) == outcome['time_s']
    assert lines[0] == title and lines[-2] == f'folder {folder}'


def test_the_folder_of_a_run_is_named_whole(monkeypatch, capsys, tmp_path):
    def stop(*_, **__):
        raise RunError('stopped')

    monkeypatch.setenv('COLUMNS', '80')
    monkeypatch.setattr('khr_bringup.running.run_graph', stop)
    folder = tmp_path / ('long' * 20)
    code, _, err = khr(monkeypatch, capsys, 'run', 'stand_0deg', '--out', folder)
    assert code == 1
    assert err.splitlines()[0].endswith(f'  folder {folder}')


@pytest.mark.parametrize(
    'words', [['--port', '99999'], ['--host', '192.0.2.1'], ['--host', 'nowhere.invalid']]
)
def test_a_page_that_cannot_be_served_is_refused_before_there_is_a_folder(
    monkeypatch, capsys, tmp_path, words
):
    monkeypatch.chdir(tmp_path)
    code, _, err = khr(monkeypatch, capsys, 'view', 'stand_0deg', '--no-browser', *words)
    assert code == 2
    assert err.startswith(f'khr: {words[0]}: ') and err.count('\n') == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ('settings', 'warning'),
    [
        (
            ['hip_controller.gain=13', 'hip_controller.staged=false'],
            'khr: --set hip_controller.gain, staged: no effect while hip_controller.enabled is '
            'false; to switch it on: --set hip_controller.enabled=true\n',
        ),
        (['hip_controller.gain=13', 'hip_controller.enabled=true'], ''),
        (['hip_controller.enabled=false'], ''),
        (['ankle_controller.gain=13', 'gait.cycles=2'], ''),
    ],
)
def test_a_gain_of_a_controller_that_is_off_is_pointed_out(monkeypatch, capsys, settings, warning):
    for name in ('run_scenario', 'view_scenario'):
        monkeypatch.setattr(f'khr.cli.run.{name}', lambda *_: 0)
    changes = [word for text in settings for word in ('--set', text)]
    for verb in ('run', 'view'):
        code, _, err = khr(monkeypatch, capsys, verb, 'walk_8.88deg_ka12', *changes)
        assert (code, err) == (0, warning)


def test_critical_points_out_a_gain_of_a_controller_that_is_off(monkeypatch, capsys):
    monkeypatch.setattr('khr_studies.measuring.critical.measure_limit', lambda *_: None)
    monkeypatch.setattr('khr_studies.measuring.critical.limit_text', lambda *_: '')
    setting = ('--set', 'ankle_controller.gain=12')
    assert 'no effect' in khr(monkeypatch, capsys, 'critical', '--ka', '0', *setting)[2]
    assert khr(monkeypatch, capsys, 'critical', '--ka', '6', *setting)[2] == ''


@pytest.mark.parametrize(('arguments', 'expected'), [([], 2), (['--help'], 0)])
def test_help_is_no_mistake(monkeypatch, capsys, arguments, expected):
    code, out, err = khr(monkeypatch, capsys, *arguments)
    assert code == expected
    assert 'scenarios' in out
    assert err == ''


def test_interruption_is_exit_code_130(monkeypatch, capsys):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(scenarios, 'load_scenario', interrupt)
    code, out, err = khr(monkeypatch, capsys, 'run', 'walk_0deg')
    assert (code, out, err) == (130, '', '')


@pytest.mark.parametrize(
    ('body', 'code', 'says'),
    [
        *(
            (f'import os\nos.kill(os.getpid(), {int(number)})\n', 130, 'khr: interrupted\n')
            for number in (signal.SIGINT, signal.SIGTERM)
        ),
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


def test_a_signal_at_the_end_of_the_interpreter_leaves_the_exit_code():
    script = LATE.format(number=int(signal.SIGTERM))
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b'')
    assert done.stdout.startswith(b'khr ')


CAUGHT = """
import os, sys
from khr.cli import app, command

def verb(standalone_mode):
    try:
        exec('import os; os.kill(os.getpid(), {number}); [None for _ in range(10**6)]')
    except KeyboardInterrupt:
        return 130

app.app = lambda first: verb
sys.argv = ['khr', 'run']
command.main()
"""


def test_an_interruption_within_an_exec_of_an_import_leaves_the_exit_code(tmp_path):
    (tmp_path / 'caught.py').write_text(CAUGHT.format(number=int(signal.SIGINT)))
    words = [sys.executable, '-m', 'caught']
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (130, b'')


@pytest.mark.slow
@pytest.mark.parametrize(
    ('words', 'locale'),
    [
        (['run', 'stand_0deg', '--offline', '--out', b'a\xff'], {}),
        (['run', 'stand_0deg', '--out', 'aü'], ASCII),
        (['run', b'a\xff'], ASCII),
        (['run', 'stand_0deg', '--set', b'gait.motion=\xff'], {}),
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


def test_file_that_fails_is_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(scenarios, 'load_scenario', lambda _: (tmp_path / 'gone').read_text())
    code, out, err = khr(monkeypatch, capsys, 'run', 'walk_0deg')
    assert (code, out) == (2, '')
    assert err == f"khr: '{tmp_path / 'gone'}': No such file or directory\n"


@pytest.mark.parametrize('columns', ['80', '200'])
def test_scenarios_lists_all(monkeypatch, capsys, columns):
    monkeypatch.setenv('COLUMNS', columns)
    code, out, _ = khr(monkeypatch, capsys, 'scenarios')
    assert code == 0
    for name in (
        'walk_7.68deg_ka12',
        'lift_3.8deg',
        'push_behind',
        'walk_9.7deg_ka12_kh12_rubber',
    ):
        assert name in out


def test_a_flag_has_no_type_and_the_verbs_are_in_groups(monkeypatch, capsys):
    for words in (['figure'], ['board'], ['board', 'probe'], []):
        _, text, _ = khr(monkeypatch, capsys, *words, '--help')
        assert '--help' in text and '<bool>' not in text
    places = [text.index(group) for group in ('Run and look', 'While it runs', 'Studies')]
    assert places == sorted(places) and 'The real robot' in text


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


def test_changes_are_one_argument_and_empty_ones_are_left_out():
    line = ros2_command(
        'walk_3deg',
        ['ankle_controller.gain=12', *settings_text({('simulator', 'sync'): 'realtime'})],
        {'driver': '', 'out': 'a folder'},
    )
    assert shlex.split(line) == [
        'ros2',
        'launch',
        'khr_bringup',
        'balance.launch.py',
        'scenario:=walk_3deg',
        'set:=ankle_controller.gain=12,simulator.sync=realtime',
        'out:=a folder',
    ]


def test_the_command_has_gains_engine_and_robot(capsys):
    start_run('lift_2.7deg', ka=18.0, engine='mujoco', robot='leaning', print_ros2=True)
    changes = shlex.split(capsys.readouterr().out)[5].removeprefix('set:=')
    launched = load_scenario('lift_2.7deg').set_to(split_changes(changes))
    meant = on_robot(load_scenario('lift_2.7deg'), 'leaning').set_to(
        ['ankle_controller.gain=18.0', 'ankle_controller.enabled=true', 'simulator.engine=mujoco']
    )
    assert launched.values == meant.values


@pytest.mark.parametrize(
    'option', [{'offline': True}, {'one_process': True}, {'domain': 3}, {'network': True}]
)
def test_an_option_that_the_command_cannot_carry_is_refused(option):
    for start, name in ((start_run, 'walk_0deg'), (start_bout, 'shove')):
        with pytest.raises(KhrError, match=r'^--.*: not with --print-ros2'):
            start(name, print_ros2=True, **option)
