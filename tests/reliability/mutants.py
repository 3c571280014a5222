"""Files that went wrong on their way: seeded mutants of good ones."""

from __future__ import annotations

import io
import random
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

from khr_bringup.scenario import scenario as scenarios
from khr_common import KhrError
from khr_hardware.joint_map import JointMap
from khr_sim.robot import Robot
from khr_studies.calibration.plan import read_plan
from khr_studies.measuring.ensemble_file import SHIPPED_ENSEMBLE, read_ensemble
from khr_studies.measuring.experiments import shipped
from khr_studies.measuring.json_file import read_json
from khr_studies.third_stage.study import Plane
from khr_sweeps.reading import load_sweep
from khr_sweeps.results.store import Store, read_store
from tests import ROOT

LONGEST_LINE = 2000  # characters of a refusal: a file's name, what is quoted, what is accepted
NASTY = (
    b'', b'[' * 2000, b'{a: ' * 300, b'&a [*a]', b'*a', b'!!float x', b'!!bool maybe', b'!!int ""',
    b'!!python/name:os.system', b'9' * 5000, b'-1e999', b'.nan', b'.inf', b'0b_', b'0x_', b'1:' * 999,
    b'2001-99-99', b'\0', b'\xff\xfe', b'\xed\xa0\x80', b'\xe2\x80\xa8', b'"' + b'x' * 40_000 + b'"',
    b'|\n  x', b'<<: {a: 1}', b'? [1]\n: 2', b'~', b'%YAML 9.9', b'---', b'...', b'\t', b'null: 1',
    b'#' * 70_000, b'{}', b'[]', b'../../etc/passwd', b'[/bold]', b"'", b'true', b'-0', b'1e308',
)  # fmt: skip


def mutants(seeds: list[bytes], count: int, seed: int) -> Iterator[bytes]:
    """Yield changed files: bytes, lines and values replaced, doubled, cut or moved."""
    chance = random.Random(seed)
    for _ in range(count):
        content = chance.choice(seeds)
        for _ in range(chance.randint(1, 4)):
            content = _mutant(content, chance)
        yield content


def _mutant(content: bytes, chance: random.Random) -> bytes:
    lines = content.split(b'\n')
    at, line = chance.randrange(len(content) + 1), chance.randrange(len(lines))
    match chance.randrange(7):
        case 0:
            return content[:at] + bytes([chance.randrange(256)]) + content[at + 1 :]
        case 1:
            return content[:at] + chance.choice(NASTY) + content[at:]
        case 2:
            return content[:at] + content[at + chance.randrange(40) :]
        case 3:
            lines[line] = lines[line].split(b':')[0] + b': ' + chance.choice(NASTY)
        case 4:
            lines.insert(line, lines[chance.randrange(len(lines))])
        case 5:
            lines[line] = b' ' * chance.randrange(6) + lines[line].strip()
        case _:
            return content.decode('utf-8', 'ignore').encode(
                chance.choice(('utf-16', 'utf-32', 'utf-8-sig', 'utf-7'))
            )
    return b'\n'.join(lines)


def try_file(path: Path, kind: str) -> str:
    """Read a file as what it claims to be; return what is wrong with the way it is refused."""
    try:
        READERS[kind](path)
    except KhrError as error:
        return _fault(str(error))
    except Exception as error:  # what this looks for
        return f'{type(error).__name__}: {error}'
    return ''


def try_change(text: str) -> str:
    """Read a change as ``--set`` does; return what is wrong with the way it is refused."""
    try:
        scenarios.load('walk_0deg').changed(scenarios.changes_of([text]))
    except KhrError as error:
        return _fault(str(error))
    except Exception as error:  # what this looks for
        return f'{type(error).__name__}: {error}'
    return ''


def _fault(text: str) -> str:
    return '' if len(text) < LONGEST_LINE and '\n' not in text else f'a long refusal: {text[:99]}'


def _results(path: Path) -> None:
    """Read results of which every line that is believed is as it was written."""
    with redirect_stderr(io.StringIO()):
        _, kept = read_store(path, dict)
    assert all(entry in RESULTS for entry in kept), 'a changed line is believed'


def results() -> bytes:
    """Return a file of results as a sweep or a search leaves it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'rows.jsonl'
        with Store(path, {'of': 'a study'}, dict) as store:
            store.add(RESULTS)
        return path.read_bytes()


RESULTS = [{'id': f'{n}', 'verdict': 'walked', 'limit_deg': n / 7} for n in range(20)]
# What khr reads of what others may have written, by what it is.
READERS: dict[str, Callable[[Path], object]] = {
    'scenario': lambda path: scenarios.load(str(path)).to_yaml(),
    'sweep': load_sweep,
    'calibration': read_plan,
    'ensemble': read_ensemble,
    'study': lambda path: read_json(path, Plane),
    'joint map': lambda path: JointMap.load(str(path)),
    'description': lambda path: Robot(path.read_text(errors='replace')),
    'results': _results,
}


def seeds() -> dict[str, list[bytes]]:
    """Return good files of each kind."""
    config, maps = files('khr_bringup') / 'config', files('khr_hardware') / 'maps'
    return {
        'scenario': [path.read_bytes() for path in scenarios.shipped()]
        + [scenarios.load('walk_9.7deg_ka12_kh13').to_yaml().encode()],
        'sweep': [path.read_bytes() for path in shipped().values()],
        'calibration': [(config / 'calibration.yaml').read_bytes()],
        'ensemble': [SHIPPED_ENSEMBLE.read_bytes()],
        'study': [(ROOT / 'docs' / 'stage3.json').read_bytes()],
        'joint map': [(maps / 'khr3hv.yaml').read_bytes()],
        'description': [(files('khr_sim') / 'urdf' / 'khr3hv.urdf').read_bytes()],
        'results': [results()],
    }
