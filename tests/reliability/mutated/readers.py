"""Whatever khr reads of what others may have written: read, it is as it should be, or refused."""

import io
import json
import os
import shutil
from contextlib import redirect_stderr
from dataclasses import asdict
from functools import partial
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

import pyarrow
from pyarrow import parquet

from khr_bringup.graph.run_registry import RunEntry, register, running
from khr_bringup.node_registry import table_of
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario import scenario as scenarios
from khr_common import KhrError
from khr_common.parameter_files import check_blocks, read_blocks
from khr_common.parameters import specifications
from khr_description.robot import DESCRIPTION, Robot
from khr_hardware.joint_map import JointMap
from khr_studies.calibration.plan import read_plan
from khr_studies.measuring.ensemble_file import SHIPPED_ENSEMBLE, read_ensemble
from khr_studies.measuring.experiments import experiment_files
from khr_studies.measuring.json_file import read_json
from khr_studies.reproduction.findings import Findings
from khr_studies.third_stage.study import Plane
from khr_sweeps.cluster import Scheduler, security_of
from khr_sweeps.reading import load_sweep
from khr_sweeps.results.folder import read_results, request_of
from khr_sweeps.results.store import Store, read_store
from khr_sweeps.trial import RESULTS as COLUMNS
from tests import ROOT
from tests.fakes.invented_runs import signals
from tests.reliability.mutated.mutants import LONGEST_LINE, mutants
from tests.support.sweeps import make_certificates

RUN = RunEntry(99, os.getpid(), 'walk_0deg', 'runs/walk_0deg', since=1.7e9)
RESULTS = [{'id': f'{n}', 'verdict': 'walked', 'limit_deg': n / 7} for n in range(20)]
CHANGES = b'ankle_controller.gain=12', b'simulator.push_point=[0, 0, 0.1]', b'gait.motion=walk'


def attempts(count, seed):
    """Yield what each of so many attempts is called, and what attempts it: of each kind alike."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'mutant.yaml'
        found = kinds(Path(folder))
        for kind, (read, good) in found.items():
            for number, content in enumerate(mutants(good, -(-count // len(found)), seed)):
                path.write_bytes(content)
                yield f'{kind} {number}', partial(_attempt, read, path)


def _attempt(read, path):
    """Read a file as what it claims to be; return what is wrong with the way it is refused."""
    try:
        read(path)
    except KhrError as error:
        text = str(error)
        bad = '\n' in text or len(text) >= LONGEST_LINE
        return f'a long refusal: {text[:99]}' if bad else ''
    except Exception as error:  # what this looks for
        return f'{type(error).__name__}: {error}'
    return ''


def kinds(folder):
    """Return what khr reads, by what it is: what reads it, and good files; some need a folder."""
    config, maps = files('khr_bringup') / 'config', files('khr_hardware') / 'maps'
    shipped = [path.read_bytes() for path in scenarios.shipped()]
    whole = scenarios.load_scenario('walk_9.7deg_ka12_kh13').to_yaml().encode()
    results, sweep, series = (folder / name for name in ('results', 'sweep', 'series'))
    tls = make_certificates(folder)
    with Store(results, {'of': 'a study'}, dict) as store:
        store.add({entry['id']: entry for entry in RESULTS})
    table = pyarrow.table({name: [kind()] for name, kind in COLUMNS.items()})
    request = {b'khr.sweep': json.dumps({'axes': {'simulator.friction': [0.1]}}).encode()}
    parquet.write_table(table.replace_schema_metadata(request), sweep)
    signals(scenarios.load_scenario('walk_0deg'), 0, 1.0).save(series)
    files_of = {
        'sweep': (load_sweep, list(experiment_files().values())),
        'calibration': (read_plan, [config / 'calibration.yaml']),
        'ensemble': (read_ensemble, [SHIPPED_ENSEMBLE]),
        'study': (lambda path: read_json(path, Findings), [ROOT / 'docs' / 'findings.json']),
        'run table': (Plane.read, [ROOT / 'docs' / 'stage3.csv']),
        'joint map': (lambda path: JointMap.load(str(path)), [maps / 'khr3hv.yaml']),
        'description': (lambda path: Robot(path.read_text(errors='replace')), [DESCRIPTION]),
        'results': (_results, [results]),
        'signals': (Series.load, [series]),
        'sweep results': (lambda path: request_of(read_results(path)), [sweep]),
        'credentials': (partial(_credentials, tls), [tls / 'cert.pem']),
    }
    return {
        **{
            kind: (read, [p.read_bytes() for p in paths])
            for kind, (read, paths) in files_of.items()
        },
        'scenario': (lambda path: scenarios.load_scenario(str(path)).to_yaml(), [*shipped, whole]),
        'parameters': (_parameters, shipped),
        'registered run': (_registered, [json.dumps(asdict(RUN)).encode()]),
        'change': (_change, CHANGES),
    }


def _results(path):
    """Read results, of which every one that is accepted is as it was written."""
    with redirect_stderr(io.StringIO()):
        _, kept = read_store(path, dict)
    assert all(entry in RESULTS for entry in kept), 'a changed result is believed'


def _registered(path):
    """List the runs of a register in which there is such an entry."""
    entry = register() / f'{path.stem}.json'
    shutil.copyfile(path, entry)
    try:
        assert all(type(each.title) is str and each.domain < 100 for each in running())
    finally:
        entry.unlink(missing_ok=True)


def _parameters(path):
    """Check a parameter file as each node checks those that it is given."""
    of_simulator = frozenset(specifications(table_of('simulator')))
    check_blocks(read_blocks(str(path)), '/simulator', of_simulator)


def _credentials(tls, path):
    """Take credentials of which the certificate is such a one."""
    with TemporaryDirectory() as folder:
        own = Path(shutil.copytree(tls, Path(folder) / 'tls'))
        shutil.copyfile(path, own / 'cert.pem')
        security_of(Scheduler('tls://localhost:1', own))


def _change(path):
    """Read a change as ``--set`` does."""
    text = path.read_bytes().decode('utf-8', 'surrogateescape')
    scenarios.load_scenario('walk_0deg').changed(scenarios.changes_of([text]))
