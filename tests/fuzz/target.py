"""What a target of the fuzzing is, and what several of them need."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from quadriga.shared.messages import Message
from tests.fuzz.damage import damage

# What texts may hold in the place of anything.
_ANYWHERE: Final = (
    "9" * 5000,
    "9" * 400,
    "[" * 3000,
    "[" * 3000 + "]" * 3000,
    "1e999",
    "1e300",
    "9223372036854775808",
    "-1",
    "true",
    "[]",
    '""',
    '"\\u0000"',
    '"\\u001b[2J"',
)
VALUES: Final = (
    *_ANYWHERE,
    "0x" + "f" * 5000,
    "nan",
    "-inf",
    "1979-05-27T07:32:00Z",
    "{a = 1}",
    '"' + "x" * 5000 + '"',
    "[1, 'a']",
    "'r1:1e999'",
    "'r1:r1:r1'",
    "'0:99999999999999'",
)
_JSON: Final = (*_ANYWHERE, '{"a":' * 3000, "NaN", "null", "{}", '"\\ud800"', "[[1]]")

Change = Callable[[bytes, np.random.Generator], bytes]


class Target(Protocol):
    """Something that reads bytes of others."""

    def make(self, random: np.random.Generator) -> bytes:
        """An input."""
        ...

    def read(self, content: bytes) -> None:
        """Read it; raises an error of the tree, or nothing."""
        ...


@dataclass(frozen=True)
class Reader:
    """A reader of one kind.

    Attributes:
        good: what it is made for.
        reads: reads bytes; raises an error of the tree, or nothing.
        change: makes an input of a good content; by default damages it.
    """

    good: Sequence[bytes]
    reads: Callable[[bytes], object]
    change: Change = damage

    def make(self, random: np.random.Generator) -> bytes:
        return self.change(choose(self.good, random), random)

    def read(self, content: bytes) -> None:
        self.reads(content)


def file_reader(
    path: Path, good: Sequence[bytes], reads: Callable[[Path], object], change: Change = damage
) -> Reader:
    """A reader of files, which stand at `path`."""

    def read(content: bytes) -> None:
        path.write_bytes(content)
        reads(path)

    return Reader(good, read, change)


def choose(known: Sequence[bytes], random: np.random.Generator) -> bytes:
    """One of them."""
    return known[int(random.integers(len(known)))]


def change_json(good: bytes, random: np.random.Generator) -> bytes:
    """A JSON text with a value that it should not have, or damaged anyhow."""
    text = good.decode()
    # What stands between a mark of JSON's and the next: a value, a name, or a part of a text.
    marks = [at for at, letter in enumerate(text) if letter in ":,[]{}"]
    if random.random() < 0.5 or len(marks) < 2:
        return damage(good, random)
    begin = int(random.integers(len(marks) - 1))
    value = _JSON[int(random.integers(len(_JSON)))]
    return (text[: marks[begin] + 1] + value + text[marks[begin + 1] :]).encode()


def change_toml(good: bytes, random: np.random.Generator) -> bytes:
    """A TOML text some of whose lines are missing, or have a value that is none."""
    changed = _toml_lines(good.decode())
    for at in random.integers(len(changed), size=int(random.integers(4))):
        name, equals, _ = changed[int(at)].partition(" = ")
        value = VALUES[int(random.integers(len(VALUES)))]
        changed[int(at)] = f"{name} = {value}" if equals and random.random() < 0.7 else ""
    text = "\n".join(changed).encode()
    return text if random.random() < 0.7 else damage(text, random)


def _toml_lines(text: str) -> list[str]:
    """The lines of a TOML text; a value of several lines is one."""
    lines = list[str]()
    for line in text.splitlines():
        begins = line.startswith(("[", "#")) or (" = " in line and not line.startswith(" "))
        if begins or not lines or not line:
            lines.append(line)
        else:
            lines[-1] += "\n" + line
    return lines


def example(kind: type[Message], tick: int = 5) -> Message:
    """A message of a type, with some content."""
    plain = {bool: True, int: 5, float: 0.1, str: "walk", list: ("r1",), dict: {"r1": 1}}
    values: dict[str, Any] = {}
    for item in fields(kind):
        meta = item.metadata
        shape = [2 if isinstance(size, str) else size for size in meta.get("shape", ())]
        values[item.name] = np.full(shape, 0.5) if shape else plain[meta["kind"]]
    return kind(**{**values, "tick": tick})
