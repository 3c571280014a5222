"""YAML is plain data of bounded size, or it is refused in one line."""

import pytest

from khr_common.strict_yaml import LARGEST_FILE, YamlError, read_file, read_yaml

BOMB = 'a: &a [x, x, x, x, x, x, x, x, x]\n' + ''.join(
    f'{this}: &{this} [{", ".join([f"*{last}"] * 9)}]\n'
    for last, this in zip('abcdefgh', 'bcdefghi', strict=True)
)


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        (BOMB, 'aliases and anchors'),
        ('[' * 1000, 'more than 20 deep'),
        ('- ' * 1000, 'more than 20 deep'),
        ('a: ' + '9' * 400, 'beyond 64 bits'),
        ('a: ' + '9' * 5000, 'not a number'),
        ('a: ' + '1:' * 20_000 + '1', 'beyond 64 bits'),
        ('a: 0b_', 'not a number'),
        ('a: !!int ""', 'the tag'),
        ('a: !!python/object:os.system x', 'the tag'),
        ('[1, 2]: 3', 'a collection as a key'),
        ('<<: {a: 1}', 'merge'),
        ('a: 1\na: 2', 'given twice'),
        ('a: \0', '#x0000'),
        ('a: \ud800', 'is no character'),
        ('"' + 'k' * 1000 + '": 1\n"' + 'k' * 1000 + '": 1', 'given twice'),
        ('#' * LARGEST_FILE + '#', 'too large'),
    ],
)
def test_what_is_no_plain_data_is_one_short_line(text, says):
    with pytest.raises(YamlError) as refusal:
        read_yaml(text, 'mine.yaml')
    line = str(refusal.value)
    assert line.startswith('mine.yaml:') and says in line
    assert len(line) < 320 and line.isprintable()


def test_dates_are_text():
    assert read_yaml('a: 2001-99-99', 'x') == {'a': '2001-99-99'}


@pytest.mark.parametrize(
    ('content', 'says'),
    [
        ('gait: 1'.encode('utf-16'), 'byte 0 is not UTF-8'),
        (b'gait: \xff', 'byte 6 is not UTF-8'),
        (b'\xff' * (LARGEST_FILE + 1), 'too large'),
    ],
)
def test_a_file_of_another_kind_is_refused(tmp_path, content, says):
    path = tmp_path / 'mine.yaml'
    path.write_bytes(content)
    with pytest.raises(YamlError, match=says):
        read_file(path)


def test_a_file_of_the_largest_size_and_one_with_a_mark_are_read(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_bytes(b'#' * LARGEST_FILE)
    assert read_yaml(read_file(path), str(path)) is None
    path.write_bytes('a: 1'.encode('utf-8-sig'))
    assert read_yaml(read_file(path), str(path)) == {'a': 1}


def test_what_cannot_be_opened_is_named(tmp_path):
    with pytest.raises(YamlError, match='Is a directory'):
        read_file(tmp_path)
