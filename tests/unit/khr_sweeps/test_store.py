"""Results in a store are believed only as they were written."""

import sqlite3

import pytest

from khr_common import KhrError, RunError
from khr_sweeps.results import store as store_module
from khr_sweeps.results.store import Store, read_store

HEAD = {'version': 'v', 'seeds': 2}


def number_of(data):
    if type(data['number']) is not int:
        raise ValueError('no number')
    return data['number']


def opened(path, head=HEAD, **options):
    return Store(path, head, number_of, **options)


def numbered(*numbers):
    return {f'run {number}': {'number': number, 'text': f'result {number}'} for number in numbers}


@pytest.fixture(scope='module')
def content(tmp_path_factory):
    """A file with five results."""
    path = tmp_path_factory.mktemp('store') / 'results'
    with opened(path) as store:
        store.add(numbered(*range(5)))
    return path


def test_results_are_read_again_and_added_to(tmp_path, content, capsys):
    path = tmp_path / 'results'
    path.write_bytes(content.read_bytes())
    with opened(path) as store:
        assert store.values == {f'run {n}': n for n in range(5)}
        store.add(numbered(5))
        assert read_store(path, number_of) == (HEAD, list(range(6))), 'also while it is open'
    store.add(numbered(6))
    assert read_store(path, number_of)[1] == list(range(6)), 'nothing is added after its end'
    assert [each.name for each in tmp_path.iterdir()] == ['results']
    assert capsys.readouterr().err == ''


def test_a_reader_finds_the_whole_new_file_or_none(tmp_path, monkeypatch):
    path, row, found = tmp_path / 'results', store_module._row, []

    def look(result):
        found.append(path.exists())
        return row(result)

    monkeypatch.setattr(store_module, '_row', look)
    opened(path).close()
    assert found == [False] and read_store(path, number_of) == (HEAD, [])
    assert [each.name for each in tmp_path.iterdir()] == ['results']


def change(path, statement):
    database = sqlite3.connect(path)
    with database:
        database.execute(statement)
    database.close()


@pytest.mark.parametrize(
    'statement',
    [
        "UPDATE results SET data = replace(data, ':3', ':4') WHERE id = 'run 3'",
        "UPDATE results SET id = 'run 7' WHERE id = 'run 3'",
    ],
)
def test_a_changed_result_is_dropped_and_reported(tmp_path, content, capsys, statement):
    path = tmp_path / 'results'
    path.write_bytes(content.read_bytes())
    change(path, statement)
    assert read_store(path, number_of)[1] == [0, 1, 2, 4]
    with opened(path) as store:
        assert [*store.values.values()] == [0, 1, 2, 4]
        store.add(numbered(9))
    assert capsys.readouterr().err == f'khr: {path}: 1 damaged result dropped\n' * 2
    with opened(path) as store:
        assert [*store.values.values()] == [0, 1, 2, 4, 9]
    assert capsys.readouterr().err == '', 'a damaged result is reported once'


def test_results_without_their_head_and_another_file_are_refused_and_kept(tmp_path, content):
    headless, letter = tmp_path / 'results', tmp_path / 'letter'
    headless.write_bytes(content.read_bytes())
    change(headless, "UPDATE results SET sum = 0 WHERE id = ''")
    letter.write_text('dear')
    for path in (headless, letter):
        before = path.read_bytes()
        for read in (opened, lambda path: read_store(path, number_of)):
            with pytest.raises(KhrError, match='no results of khr'):
                read(path)
        assert path.read_bytes() == before


def test_results_of_another_computation_are_removed_only_where_that_is_asked_for(
    tmp_path, content
):
    path, other = tmp_path / 'results', {**HEAD, 'seeds': 3}
    path.write_bytes(content.read_bytes())
    with pytest.raises(KhrError):
        opened(path, other)
    with opened(path, other, replace=True) as store:
        assert store.replaced and not store.values
    assert read_store(path, number_of) == (other, [])


def test_a_full_disk_is_one_line_and_keeps_the_finished_results(tmp_path, capsys):
    path = tmp_path / 'results'
    with opened(path) as store:
        store._database.execute('PRAGMA max_page_count = 10')  # SQLite's own full disk
        with pytest.raises(RunError, match=r'\A.*full; finished results are kept\Z'):
            for number in range(100):
                store.add({f'run {number}': {'number': number, 'text': 2000 * 'x'}})
        count = len(store.values)
    assert count > 5 and read_store(path, number_of)[1] == [*range(count)]
    assert capsys.readouterr().err == ''
