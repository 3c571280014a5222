"""Compare the kept hashes with those of this machine; ``--write`` renews what is kept."""

import argparse
import json
import sys

from khr_common.arithmetic import enter, warning
from khr_common.files import write_text
from tests.golden import EMULATED, FILE, expected, measure, measure_all

enter()
parser = argparse.ArgumentParser('tests.golden', description=__doc__)
parser.add_argument('--write', action='store_true', help='renew the kept hashes')
parser.add_argument('--short', nargs='+', help='print those of the emulated run, of these engines')
options = parser.parse_args()
if options.short:
    print(*(measure(EMULATED[0], engine, EMULATED[1]) for engine in options.short), sep='\n')
    raise SystemExit(0)
if text := warning():
    sys.exit(f'tests.golden: {text}')
kept, found = expected() if FILE.exists() else {}, measure_all()
for name, value in found.items():
    print(
        f'{name}: {kept.get(name, "new")[:16]} {"=" if kept.get(name) == value else "->"} {value[:16]}'
    )
if options.write:
    write_text(FILE, json.dumps(found, indent=2) + '\n')
elif kept != found:
    sys.exit('tests.golden: other trajectories; --write renews what is kept')
