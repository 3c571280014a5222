"""What is kept is believed only as it was written: damaged lines are left out by name."""

import json
import multiprocessing
import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from khr_common import KhrError, RunError
from khr_sweeps.results.store import BusyError, OtherResultsError, Store, read_store

HEAD = {'version': 'v', 'seeds': 2}


def number_of(entry):
    if type(entry['number']) is not int:
        raise ValueError('no number')
    return entry['number']


def opened(path, head=HEAD, **options):
    return Store(path, head, number_of, **options)


def entries(count, start=0):
    return [{'id': f'run {n}', 'number': n} for n in range(start, start + count)]


@pytest.fixture(scope='module')
def content(tmp_path_factory):
    """A file with five results."""
    path = tmp_path_factory.mktemp('store') / 'rows'
    with opened(path) as store:
        store.add(entries(5))
    return path.read_bytes()


def test_results_are_there_again_and_go_on(tmp_path, content, capsys):
    path = tmp_path / 'rows'
    path.write_bytes(content)
    with opened(path) as store:
        assert store.values == {f'run {n}': n for n in range(5)}
        store.add(entries(1, 5))
    assert read_store(path, number_of) == (HEAD, list(range(6)))
    assert all(isinstance(json.loads(line), dict) for line in path.read_text().splitlines())
    assert capsys.readouterr().err == ''


@given(st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_cut_anywhere_keeps_whole_lines_silently(content, tmp_path, capsys, data):
    path, cut = tmp_path / 'rows', data.draw(st.integers(0, len(content)))
    path.write_bytes(content[:cut])
    with opened(path) as store:
        whole = max(content[:cut].count(b'\n') - 1, 0)
        assert list(store.values.values()) == list(range(whole))
        store.add(entries(5 - whole, whole))
    assert path.read_bytes() == content
    assert capsys.readouterr().err == ''


@pytest.mark.slow
@given(st.integers(1, 5), st.data())
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_done_to_a_line_it_is_left_out_by_name(content, tmp_path, capsys, row, data):
    path, lines = tmp_path / 'rows', content.splitlines(keepends=True)
    good = lines[row]
    bad = data.draw(
        st.one_of(
            st.binary(max_size=80),
            st.sampled_from(
                [b'', b'[]', b'null', b'\0' * 9, b'{}', b'{"id": "run 0"}', good[:30]]
            ),
            st.integers(0, len(good) - 2).flatmap(
                lambda at: st.integers(1, 255).map(
                    lambda flip: good[:at] + bytes([good[at] ^ flip]) + good[at + 1 : -1]
                )
            ),
            st.just(good[:-1].replace(b'"number": ', b'"number": 1')),
        ).filter(lambda bad: b'\n' not in bad and bad != good[:-1])
    )
    lines[row] = bad + b'\n'
    path.write_bytes(b''.join(lines))
    kept = [n for n in range(5) if n != row - 1]
    assert read_store(path, number_of)[1] == kept
    assert f'line {row + 1}\n' in capsys.readouterr().err
    with opened(path) as store:
        assert list(store.values.values()) == kept
    said = capsys.readouterr().err
    assert str(path) in said and 'left out' in said and f'line {row + 1}\n' in said
    with opened(path) as store:  # what was left out is gone
        store.add(entries(1, row - 1))
    assert sorted(read_store(path, number_of)[1]) == list(range(5))
    assert capsys.readouterr().err == ''


def test_a_result_of_another_computation_or_type_is_left_out(tmp_path, content, capsys):
    path, other = tmp_path / 'rows', tmp_path / 'other'
    with opened(other, HEAD | {'version': 'w'}) as store:
        store.add(entries(1, 7))
    with Store(path, HEAD, lambda entry: entry) as store:
        store.add([{'id': 'run 8', 'number': 'eight'}])
    path.write_bytes(path.read_bytes() + other.read_bytes().splitlines(keepends=True)[1])
    with opened(path) as store:
        assert store.values == {}
    assert 'line 2, 3\n' in capsys.readouterr().err


def test_a_damaged_first_line_is_written_again_if_results_show_whose_they_are(
    tmp_path, content, capsys
):
    path = tmp_path / 'rows'
    path.write_bytes(b'!' + content[1:])
    with pytest.raises(OtherResultsError):
        read_store(path, number_of)
    with opened(path) as store:
        assert len(store.values) == 5
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    ('key', 'value'), [('version', 'w'), ('seeds', 3), ('seeds', None), ('more', 1)]
)
def test_results_of_something_else_are_refused_or_replaced(tmp_path, content, key, value):
    path = tmp_path / 'rows'
    path.write_bytes(content)
    head = {name: each for name, each in (HEAD | {key: value}).items() if each is not None}
    with pytest.raises(OtherResultsError) as refusal:
        opened(path, head)
    assert refusal.value.key == key and '\n' not in str(refusal.value)
    assert path.read_bytes() == content
    with opened(path, head, replace=True) as store:
        assert store.replaced and store.values == {}


@pytest.mark.parametrize('text', ['dear\n', '{}\n', '[1, 2]\n{}\n', 'dear', '\0'])
def test_a_letter_is_left_alone(tmp_path, text):
    (tmp_path / 'letter').write_text(text)
    with pytest.raises(KhrError, match='something else'):
        opened(tmp_path / 'letter')
    assert (tmp_path / 'letter').read_text() == text


def test_two_writers_do_not_share_a_file(tmp_path):
    with opened(tmp_path / 'rows'), pytest.raises(BusyError, match='another command'):
        opened(tmp_path / 'rows')
    with opened(tmp_path / 'rows') as store:
        store.add(entries(1))


def test_nothing_is_written_after_the_end(tmp_path):
    with opened(tmp_path / 'rows') as store:
        pass
    store.add(entries(1))
    assert read_store(tmp_path / 'rows', number_of)[1] == []


def fill(path, found):
    """Write results until the limit of the file's size; say what is then there."""
    import resource
    import signal

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
    with opened(path) as store:
        try:
            for number in range(1000):
                store.add(entries(1, number))
        except RunError as error:
            found.put((str(error), len(store.values)))


@pytest.mark.slow
def test_a_disk_that_takes_no_more_is_one_line_and_no_torn_result(tmp_path, capsys):
    context = multiprocessing.get_context('spawn')
    found = context.Queue()
    process = context.Process(target=fill, args=(tmp_path / 'rows', found))
    process.start()
    message, count = found.get(timeout=60.0)
    process.join()
    assert 'what is finished is kept' in message and os.linesep not in message
    assert read_store(tmp_path / 'rows', number_of)[1] == list(range(count))
    assert capsys.readouterr().err == ''
