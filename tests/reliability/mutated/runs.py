"""Hand damaged runs to report, verify and film, each within some seconds; print what fails.

python -m tests.reliability.mutated.runs COUNT [SEED]
"""

import contextlib
import io
import random
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from khr.cli import command
from tests.reliability.mutated.mutants import LONGEST_LINE, NASTY
from tests.support.runs import KHR

SECONDS = 0.6  # simulated, of the run that is damaged
LIMIT = 60  # s for a command: what is whole enough to be read takes a few, under load too
COMMANDS = (('verify',), ('report',), ('film', '--still', '0.3'), ('lines',), ('recover',))
EXPECTED = {0, 1, 2}


def faults(count: int, seed: int) -> list[str]:
    """Return what went wrong with so many damaged runs, each handed to one command."""
    chance, found = random.Random(seed), []
    with TemporaryDirectory() as folder:
        good = Path(folder) / 'good'
        subprocess.run(
            [*KHR, 'run', 'stand_0deg', '--one-process', '--duration', str(SECONDS), '--out', good],
            check=True, capture_output=True,
        )  # fmt: skip
        for number in range(count):
            bad = Path(folder) / 'bad'
            shutil.copytree(good, bad)
            harms = [_harm(bad, chance) for _ in range(chance.randint(1, 2))]
            name, *options = COMMANDS[number % len(COMMANDS)]
            fault = attempt([name, str(bad), *options])
            found += [f'{number} {name}, {" and ".join(harms)}: {fault}'] if fault else []
            shutil.rmtree(bad)
    return found


def attempt(arguments: list[str]) -> str:
    """Run a khr command here; return what is wrong with the way it ends."""
    out, err = io.StringIO(), io.StringIO()
    signal.alarm(LIMIT)
    try:
        with (
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            patch.object(sys, 'argv', ['khr', *arguments]),
        ):
            command.main()
        code: object = 0
    except SystemExit as end:
        code = end.code or 0
    except TimeoutError:
        return f'took more than {LIMIT} s'
    except BaseException as error:  # what this looks for
        return f'{type(error).__name__}: {error}'
    finally:
        signal.alarm(0)
    text = err.getvalue()
    if code not in EXPECTED:
        return f'exit {code}: {text[:99]}'
    if 'Traceback' in text or (code == 2 and text.count('\n') != 1):
        return f'not one line: {text[:300]}'
    return '' if len(text) < LONGEST_LINE else f'a long refusal: {text[:99]}'


def _harm(run: Path, chance: random.Random) -> str:
    """Damage a file of a run, or its folder; return which and how."""
    if chance.random() < LAYOUT:
        how, lay = chance.choice(LAYOUTS)
        lay(run / 'bag')
        return f'bag {how}'
    names = ['bag/*.mcap'] * 4 + ['bag/metadata.yaml', 'outcome.json', 'scenario.yaml']
    files = sorted(run.glob(chance.choice(names)))
    if not files or not files[0].is_file():
        return 'nothing'
    path, content = files[0], bytearray(files[0].read_bytes())
    how, change = chance.choice(HARMS)
    changed = change(content, chance)
    path.unlink()
    if changed is not None:
        path.write_bytes(changed)
    return f'{path.name} {how}'


def _flip(content: bytearray, chance: random.Random) -> bytes:
    for _ in range(chance.randint(1, 30) if content else 0):
        content[chance.randrange(len(content))] = chance.randrange(256)
    return bytes(content)


def _nasty(content: bytearray, chance: random.Random) -> bytes:
    at = chance.randrange(len(content) + 1)
    return bytes(content[:at]) + chance.choice(NASTY) + bytes(content[at:])


def _cut(content: bytearray, chance: random.Random) -> bytes:
    return bytes(content[: chance.randrange(len(content) + 1)])


def _missing(content: bytearray, chance: random.Random) -> bytes:
    at = chance.randrange(len(content) + 1)
    return bytes(content[:at] + content[at + chance.randrange(500) :])


def _twice(content: bytearray, chance: random.Random) -> bytes:
    first, second = sorted(chance.randrange(len(content) + 1) for _ in range(2))
    return bytes(content[:second] + content[first:])


def _zeros(content: bytearray, chance: random.Random) -> bytes:
    at = chance.randrange(len(content) + 1)
    size = min(len(content) - at, chance.randrange(1, 5000))
    return bytes(content[:at]) + bytes(size) + bytes(content[at + size :])


def _gone(_content: bytearray, _chance: random.Random) -> None:
    return None


def _moved(bag: Path) -> None:
    for file in list(bag.glob('*.mcap')):
        file.rename(bag.parent / file.name)


def _renamed(bag: Path) -> None:
    for file in list(bag.glob('*.mcap')):
        file.rename(file.with_name('other.mcap'))


def _doubled(bag: Path) -> None:
    other = bag / 'bag_1.mcap'
    for file in list(bag.glob('*.mcap')):
        if file.is_file() and not other.exists():  # another harm may have come before
            shutil.copyfile(file, other)


def _swapped(bag: Path) -> None:
    for file in list(bag.glob('*')):
        _remove(file)
        file.mkdir()


def _circle(bag: Path) -> None:
    for file in list(bag.glob('*')):
        _remove(file)
        file.symlink_to(file)


def _remove(path: Path) -> None:
    """Remove a file, or a folder that another harm put in its place."""
    if path.is_dir():
        path.rmdir()
    else:
        path.unlink()


def _nothing(bag: Path) -> None:
    shutil.rmtree(bag, ignore_errors=True)
    bag.unlink(missing_ok=True)
    bag.mkdir()


def _file(bag: Path) -> None:
    shutil.rmtree(bag, ignore_errors=True)
    bag.write_bytes(b'no folder')


LAYOUT = 0.25  # share of the harms that are done to the folder
LAYOUTS: tuple[tuple[str, Callable[[Path], None]], ...] = (
    ('files beside the folder', _moved),
    ('file with another name', _renamed),
    ('file twice', _doubled),
    ('with folders in place of files', _swapped),
    ('with links that lead in a circle', _circle),
    ('empty', _nothing),
    ('a file', _file),
)
HARMS: tuple[tuple[str, Callable[[bytearray, random.Random], bytes | None]], ...] = (
    ('with other bytes', _flip),
    ('with something nasty in it', _nasty),
    ('cut', _cut),
    ('with a part missing', _missing),
    ('with a part twice', _twice),
    ('with zeros in it', _zeros),
    ('gone', _gone),
)


def _late(*_: object) -> None:
    raise TimeoutError


def main() -> int:
    """Damage as many runs as the command line says; return 1 if anything fell short."""
    signal.signal(signal.SIGALRM, _late)
    count, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    lines = faults(count, seed)
    print(*lines, f'{count} damaged runs, {len(lines)} faults', sep='\n')
    return int(bool(lines))


if __name__ == '__main__':
    sys.exit(main())
