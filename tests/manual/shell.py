"""The simple commands that a block of a shell is made of."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from typing import Final

_SIGNS: Final = frozenset(";()<>|&")
_ASSIGNMENT: Final = re.compile(r"[A-Za-z_]\w*=")


def split_commands(text: str) -> list[list[str]]:
    """The words of each command, without redirections and without variables set for it.

    What may fail, as `a` of `a || b` may, is left out.
    """
    lines = text.replace("\\\n", " ").splitlines()
    return [command for line in lines for command in _split_line(line)]


def _split_line(line: str) -> Iterator[list[str]]:
    lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    words: list[str] = []
    redirected = False
    for token in lexer:
        if redirected:  # the file that is read or written
            redirected = False
        elif not _SIGNS.issuperset(token):
            words.append(token)
        elif token in (">", ">>", "<", ">&"):
            redirected = True
            if words and words[-1].isdigit():
                words.pop()
        else:
            if token != "||":
                yield from _without_assignments(words)
            words = []
    yield from _without_assignments(words)


def _without_assignments(words: list[str]) -> Iterator[list[str]]:
    while words and _ASSIGNMENT.match(words[0]):
        words = words[1:]
    if words:
        yield words
