"""Damaged runs for the commands that read runs."""

import random
import shutil
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.reliability.mutated.mutants import LONGEST_LINE, mutant
from tests.support.in_process import khr_here
from tests.support.runs import khr

COMMANDS = (('verify',), ('report',), ('film', '--still', '0.3'), ('lines',), ('recover',))
# Done to the file in the bag of a run, or to the bag.
LAYOUTS = {
    'beside the bag': lambda file: file.rename(file.parent.parent / file.name),
    'with another name': lambda file: file.rename(file.with_name('other.mcap')),
    'twice': lambda file: shutil.copyfile(file, file.with_name('bag_1.mcap')),
    'gone': lambda file: file.unlink(),
    'a folder': lambda file: (file.unlink(), file.mkdir()),
    'a link to itself': lambda file: (file.unlink(), file.symlink_to(file)),
    'gone with all of the bag': lambda file: (shutil.rmtree(file.parent), file.parent.mkdir()),
    'in a bag that is a file': lambda file: (
        shutil.rmtree(file.parent),
        file.parent.write_bytes(b'no folder'),
    ),
}
FILES = ('bag/*.mcap',) * 4 + ('bag/metadata.yaml', 'outcome.json', 'scenario.yaml')


def attempts(count, seed):
    """Yield what each of so many attempts is called, and what attempts it."""
    chance = random.Random(seed)
    with TemporaryDirectory() as folder:
        good, bad = Path(folder) / 'good', Path(folder) / 'bad'
        made = khr('run', 'stand_0deg', '--one-process', '--duration', '0.6', '--out', good)
        assert made.code == 0, made.err
        for number in range(count):
            shutil.copytree(good, bad)
            harm = _damage(bad, chance)
            name, *options = COMMANDS[number % len(COMMANDS)]
            yield f'{number} {name}, {harm}', partial(_attempt, name, bad, *options)
            shutil.rmtree(bad)


def _damage(run, chance):
    """Damage a file of a run, or the way that its files lie; return how."""
    if chance.random() < 0.25:
        how = chance.choice(list(LAYOUTS))
        LAYOUTS[how](next(run.glob('bag/*.mcap')))
        return f'file of the bag {how}'
    path = next(run.glob(chance.choice(FILES)))
    path.write_bytes(mutant(path.read_bytes(), chance))
    return f'{path.name} with other content'


def _attempt(*arguments):
    """Run a khr command here; return what is wrong with the way it ends."""
    try:
        ended = khr_here(*arguments)
    except Exception as error:  # what this looks for
        return f'{type(error).__name__}: {error}'
    text = ended.err
    if ended.code not in (0, 1, 2):
        return f'exit {ended.code}: {text[:99]}'
    if 'Traceback' in text or (ended.code == 2 and text.count('\n') != 1):
        return f'not one line: {text[:300]}'
    return '' if len(text) < LONGEST_LINE else f'a long refusal: {text[:99]}'
