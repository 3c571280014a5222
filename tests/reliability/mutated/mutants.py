"""Files that went wrong on their way: seeded mutants of good ones."""

import random
from collections.abc import Iterator

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
