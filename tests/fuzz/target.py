"""What a target of the fuzzing is, and what several of them need."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from quadriga.shared.messages import Message
from tests.fuzz.damage import damage

VALUES: Final = (
    "9" * 5000,
    "9" * 400,
    "[" * 3000,
    "[" * 3000 + "]" * 3000,
    "0x" + "f" * 5000,
    "1e999",
    "nan",
    "-inf",
    "true",
    '"\\u0000"',
    '"\\u001b[2J"',
    "1979-05-27T07:32:00Z",
    "{a = 1}",
    "[]",
    '""',
    "-1",
    "1e300",
    '"' + "x" * 5000 + '"',
    "[1, 'a']",
    "9223372036854775808",
    "'r1:1e999'",
    "'r1:r1:r1'",
    "'0:99999999999999'",
)
# What JSON texts and lines of tables may hold in the place of anything.
_JSON: Final = (
    "9" * 5000,
    "9" * 400,
    "[" * 3000,
    "[" * 3000 + "]" * 3000,
    '{"a":' * 3000,
    "1e999",
    "NaN",
    "-1",
    "null",
    "true",
    "[]",
    "{}",
    '""',
    '"\\ud800"',
    '"\\u0000"',
    '"\\u001b[2J"',
    "1e300",
    "9223372036854775808",
    "[[1]]",
)


class Target(Protocol):
    """Something that reads bytes of others."""

    def make(self, random: np.random.Generator) -> bytes:
        """An input."""
        ...

    def read(self, content: bytes) -> None:
        """Read it; raises an error of the tree, or nothing."""
        ...


class FileReader:
    """A reader of files of one kind.

    Args:
        path: of the file that is read.
        good: what such files may hold.
        read: reads the file; raises an error of the tree, or nothing.
        change: makes an input of a good content; by default damages it.
    """

    def __init__(
        self,
        path: Path,
        good: Sequence[bytes],
        read: Callable[[Path], object],
        change: Callable[[bytes, np.random.Generator], bytes] = damage,
    ) -> None:
        self._path, self._good, self._read, self._change = path, tuple(good), read, change

    def make(self, random: np.random.Generator) -> bytes:
        return self._change(choose(self._good, random), random)

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        self._read(self._path)


class Texts:
    """A reader of bytes that are in memory already."""

    def __init__(self, good: Sequence[bytes], read: Callable[[bytes], object]) -> None:
        self._good, self._read = tuple(good), read

    def make(self, random: np.random.Generator) -> bytes:
        return change_json(choose(self._good, random), random)

    def read(self, content: bytes) -> None:
        self._read(content)


def choose(known: Sequence[bytes], random: np.random.Generator) -> bytes:
    """One of them."""
    return known[int(random.integers(len(known)))]


def change_json(good: bytes, random: np.random.Generator) -> bytes:
    """A JSON text with a value that it should not have, or damaged anyhow."""
    if random.random() < 0.5:
        return damage(good, random)
    text = good.decode()
    # What stands between a mark of JSON's and the next: a value, a name, or a part of a text.
    marks = [at for at, letter in enumerate(text) if letter in ":,[]{}"]
    if len(marks) < 2:
        return damage(good, random)
    begin = int(random.integers(len(marks) - 1))
    value = _JSON[int(random.integers(len(_JSON)))]
    return (text[: marks[begin] + 1] + value + text[marks[begin + 1] :]).encode()


def change_toml(lines: Sequence[str], random: np.random.Generator) -> bytes:
    """A TOML text some of whose lines are missing, or have a value that is none.

    Args:
        lines: of the good text, see `toml_lines`.
        random: chooses.
    """
    changed = list(lines)
    for at in random.integers(len(lines), size=int(random.integers(4))):
        name, equals, _ = changed[int(at)].partition(" = ")
        value = VALUES[int(random.integers(len(VALUES)))]
        changed[int(at)] = f"{name} = {value}" if equals and random.random() < 0.7 else ""
    text = "\n".join(changed).encode()
    return text if random.random() < 0.7 else damage(text, random)


def toml_lines(text: str) -> list[str]:
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
