"""The folder of a sweep: nothing is lost, mixed or overwritten."""

import io
import json
import threading

import pyarrow.parquet
import pytest

from khr_common import KhrError
from khr_sweeps.results.folder import ROWS, Folder, read_results
from khr_sweeps.results.store import Store
from khr_sweeps.trial import RESULTS

REQUEST = {
    'version': 'v',
    'scenario': {},
    'cases': {},
    'axes': {
        'case': ['a', 'b'],
        'gait.motion': ['walk', 'stand'],
        'simulator.pushes': [['a'], ['b', 'c']],
    },
    'samples': None,
    'seeds': 2,
    'keep': False,
}


def row_of(number):
    return {
        'id': f'run {number}',
        'case': 'a',
        'gait.motion': 'walk',
        'simulator.pushes': ['b', 'c'],
        'seed': None,
        **dict.fromkeys(RESULTS),
        'distance_m': number / 3,
        'verdict': 'fell',
    }


def test_rows_are_read_while_they_are_added_and_from_the_table_alone(tmp_path):
    with Folder(tmp_path, REQUEST) as folder:
        folder.append([row_of(0), row_of(1)])
        assert read_results(tmp_path).to_pylist() == [row_of(0), row_of(1)]
    with Folder(tmp_path, REQUEST) as folder:
        folder.append([row_of(2)])
        assert folder.finished() == {f'run {n}': None for n in range(3)}
        schema = pyarrow.parquet.read_schema(folder.export())
    assert json.loads(schema.metadata[b'khr.sweep']) == REQUEST
    (tmp_path / ROWS).unlink()
    assert read_results(tmp_path).to_pylist() == [row_of(n) for n in range(3)]


@pytest.mark.parametrize(
    ('changed', 'says'),
    [
        ({'version': 'w'}, 'another version'),
        ({'axes': {}}, 'other axes'),
        ({'scenario': {'gait': {}}}, 'another scenario'),
    ],
)
def test_another_sweep_is_refused_and_left_alone(tmp_path, changed, says):
    with Folder(tmp_path, REQUEST) as folder:
        folder.append([row_of(1)])
    before = (tmp_path / ROWS).read_bytes()
    with pytest.raises(KhrError, match=says):
        Folder(tmp_path, REQUEST | changed)
    assert (tmp_path / ROWS).read_bytes() == before


def test_a_place_that_is_no_folder_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(KhrError, match=r'--out: .*file'):
        Folder(tmp_path / 'file', REQUEST)


@pytest.mark.parametrize('replace', [False, True])
def test_a_folder_with_something_else_is_refused_and_left_alone(tmp_path, replace):
    (tmp_path / 'letter.txt').write_text('dear')
    with pytest.raises(KhrError, match='contains something else'):
        Folder(tmp_path, REQUEST, replace=replace)
    assert [path.name for path in tmp_path.iterdir()] == ['letter.txt']


def test_another_sweep_can_be_replaced(tmp_path):
    path = tmp_path / 'sweep'
    with Folder(path, REQUEST, replace=True) as folder:
        assert not folder.replaced
        folder.append([row_of(1)])
        folder.export()
        (path / 'series').mkdir()
        (path / 'series' / 'run 1.npz').write_bytes(b'')
        with pytest.raises(KhrError, match='being written'):
            Folder(path, REQUEST | {'seeds': 3}, replace=True)
    with Folder(path, REQUEST, replace=True) as folder:
        assert not folder.replaced and folder.finished()
    with Folder(path, REQUEST | {'seeds': 3}, replace=True) as folder:
        assert folder.replaced and not folder.finished()
    with Folder(path, REQUEST, replace=True) as folder:  # has neither a table nor signals
        assert folder.replaced
    assert [each.name for each in path.iterdir()] == [ROWS]


@pytest.mark.parametrize('name', ['sweep.json', '.9-results.parquet', 'sweep.json.part', ROWS])
def test_a_folder_that_a_killed_command_began_is_taken_over(tmp_path, name):
    (tmp_path / name).write_bytes(b'')
    with Folder(tmp_path, REQUEST) as folder:
        folder.append([row_of(1)])
    assert read_results(tmp_path).num_rows == 1


def test_results_of_a_version_without_a_column_are_refused(tmp_path):
    row = row_of(1)
    del row['stayed_up']
    with Store(tmp_path / ROWS, REQUEST, dict) as store:
        store.add({'run 1': row})
    with pytest.raises(KhrError, match=r"lack the column 'stayed_up'; accepted: .* repeat"):
        read_results(tmp_path)


def test_a_folder_that_another_command_writes_can_be_waited_for(tmp_path, monkeypatch):
    path, found, said = tmp_path / 'sweep', [], io.StringIO()
    monkeypatch.setattr('sys.stderr', said)  # reading pytest's own loses what comes meanwhile

    def wait():
        with Folder(path, REQUEST, wait=True) as folder:
            found.append(set(folder.finished()))

    with Folder(path, REQUEST) as folder:
        waiting = threading.Thread(target=wait)
        waiting.start()
        while 'waiting for another command' not in said.getvalue():
            assert waiting.is_alive()
        folder.append([row_of(1)])
    waiting.join()
    assert found == [{row_of(1)['id']}]
