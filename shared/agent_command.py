"""The command line of a program of one's own that is the agent of each robot.

Any program that speaks the plant link may be one, see docs/tutorials/own_controller.md.
"""

from __future__ import annotations

import hashlib
import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from quadriga.shared.errors import ConfigError, name_file_errors

KEY: Final = "team.agent_command"
# What stands in braces in the command line, and is filled in for each robot; the program finds the
# same in its environment, under this prefix and in capitals.
PLACES: Final = ("robot", "team", "config", "endpoint", "mode", "listen", "plant", "link")
ENVIRONMENT: Final = "QUADRIGA_"
_PLACE: Final = re.compile(r"\{(\w+)\}")


def parse_line(line: str) -> tuple[str, ...]:
    """The words of a command line, as a shell would split them.

    Raises:
        ConfigError: it has none, a quotation is not closed, or braces hold no known place.
    """
    try:
        words = tuple(shlex.split(line))
    except ValueError as error:
        raise ConfigError(KEY, repr(line), "a command line", str(error).lower()) from None
    if not words:
        raise ConfigError(KEY, repr(line), "a command line, or '' for the project's own agents")
    for name in _PLACE.findall(line):
        if name not in PLACES:
            known = ", ".join(f"{{{place}}}" for place in PLACES)
            raise ConfigError(KEY, f"{{{name}}} in {line!r}", f"one of {known}")
    return words


def fill_in(words: Sequence[str], places: Mapping[str, str]) -> tuple[str, ...]:
    """The words with what stands at each of `PLACES` filled in."""
    return tuple(_PLACE.sub(lambda match: places.get(match[1], match[0]), word) for word in words)


def environment_of(places: Mapping[str, str]) -> dict[str, str]:
    """The variables by which a program finds what stands at each of `PLACES`."""
    return {f"{ENVIRONMENT}{name.upper()}": value for name, value in places.items()}


def command_origin(line: str) -> str:
    """A command line with the digest of all files that it names; "" for the project's own agents.

    A file may stand behind an `=`, as in `--weights=FILE`. The digest has 16 hexadecimal digits.
    Files that the program opens by itself are not part of it.

    Raises:
        ConfigError: as `parse_line`, or a file cannot be read.
    """
    if not line:
        return ""
    digest = hashlib.sha256()
    for word in parse_line(line):
        for text in dict.fromkeys((word, word.rpartition("=")[2])):
            path = Path(text)
            if text and path.is_file():
                with name_file_errors(ConfigError, KEY, "a file that can be read", text):
                    digest.update(f"\0{path}\0".encode() + path.read_bytes())
    return f"{line} {digest.hexdigest()[:16]}"
