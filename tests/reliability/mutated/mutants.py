"""Files that went wrong on their way: seeded mutants of good ones."""

import random

LONGEST_LINE = 2000  # characters of a refusal: a file's name, what is quoted, what is accepted
NASTY = (
    b'', b'[' * 2000, b'{a: ' * 300, b'&a [*a]', b'*a', b'!!float x', b'!!bool maybe', b'!!int ""',
    b'!!python/name:os.system', b'9' * 5000, b'-1e999', b'.nan', b'.inf', b'0b_', b'0x_', b'1:' * 999,
    b'2001-99-99', b'\0', b'\xff\xfe', b'\xed\xa0\x80', b'\xe2\x80\xa8', b'"' + b'x' * 40_000 + b'"',
    b'|\n  x', b'<<: {a: 1}', b'? [1]\n: 2', b'~', b'%YAML 9.9', b'---', b'...', b'\t', b'null: 1',
    b'#' * 70_000, b'{}', b'[]', b'../../etc/passwd', b'[/bold]', b"'", b'true', b'-0', b'1e308',
)  # fmt: skip


def mutants(seeds, count, seed):
    """Yield changed files."""
    chance = random.Random(seed)
    for _ in range(count):
        yield mutant(chance.choice(seeds), chance)


def mutant(content, chance):
    """Return a changed file: bytes, lines and values replaced, doubled, cut or moved."""
    for _ in range(chance.randint(1, 4)):
        content = _changed(content, chance)
    return content


def _changed(content, chance):
    lines = content.split(b'\n')
    first, at = sorted(chance.randrange(len(content) + 1) for _ in range(2))
    line = chance.randrange(len(lines))
    match chance.randrange(10):
        case 0:
            return content[:at] + bytes([chance.randrange(256)]) + content[at + 1 :]
        case 1:
            return content[:at] + chance.choice(NASTY) + content[at:]
        case 2:
            return content[:at] + content[at + chance.randrange(40) :]
        case 3:
            return content[:at]
        case 4:
            return content[:at] + content[first:]
        case 5:
            return content[:first] + bytes(at - first) + content[at:]
        case 6:
            lines[line] = lines[line].split(b':')[0] + b': ' + chance.choice(NASTY)
        case 7:
            lines.insert(line, lines[chance.randrange(len(lines))])
        case 8:
            lines[line] = b' ' * chance.randrange(6) + lines[line].strip()
        case _:
            encodings = ('utf-16', 'utf-32', 'utf-8-sig', 'utf-7')
            return content.decode('utf-8', 'ignore').encode(chance.choice(encodings))
    return b'\n'.join(lines)
