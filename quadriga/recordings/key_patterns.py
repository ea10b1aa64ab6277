"""Which keys a user means by `state`, `r1`, `r*/plan`, `team/sim/truth` or `**`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Final

from quadriga.shared.errors import ConfigError
from quadriga.shared.topics import TABLE

_ALLOWED: Final = re.compile(r"[\w.*?-]+(/[\w.*?-]+)*")
_GLOB: Final = re.compile(r"[*?]")


@dataclass(frozen=True, slots=True)
class KeyPattern:
    """Keys of a team.

    Attributes:
        expression: what to subscribe to so as to hear them all, and perhaps others.
        regex: what a key of these matches as a whole.
    """

    expression: str
    regex: re.Pattern[str]

    def matches(self, key: str) -> bool:
        """Whether `key` is one of them."""
        return self.regex.fullmatch(key) is not None


def key_pattern(text: str, team: str, option: str = "KEY") -> KeyPattern:
    """The keys that `text` stands for.

    Without a slash it names topics or robots (`plan`, `st*`, `r2`); else it is a key with or
    without the team before it, in which `*` stands for anything between two slashes and `**` for
    anything at all.

    Raises:
        ConfigError: it cannot be a key.
    """
    if not _ALLOWED.fullmatch(text):
        raise ConfigError(option, repr(text), "a topic, a robot or a key such as r1/state or r*/**")
    if "/" not in text and text != "**":
        topics = [topic.key(team, "*") for topic in TABLE if fnmatchcase(topic.name, text)]
        globs = [*topics, f"{team}/{text}/**"]
        single = len(topics) == 1 and not _GLOB.search(text)
        return KeyPattern(topics[0] if single else f"{team}/**", _regex(globs))
    key = text if text.startswith(f"{team}/") else f"{team}/{text}"
    chunks = ["*" if _GLOB.search(c) and c != "**" else c for c in key.split("/")]
    return KeyPattern("/".join(chunks).replace("**/**", "**"), _regex([key]))


def key_patterns(texts: Iterable[str], team: str, option: str) -> tuple[KeyPattern, ...]:
    """Several of them."""
    return tuple(key_pattern(text, team, option) for text in texts)


def _regex(globs: Iterable[str]) -> re.Pattern[str]:
    return re.compile("|".join(f"(?:{_translate(glob)})" for glob in globs))


def _translate(glob: str) -> str:
    parts = []
    chunks = glob.split("/")
    for last, chunk in zip([False] * (len(chunks) - 1) + [True], chunks, strict=True):
        if chunk == "**":
            parts.append(".*" if last else "(?:[^/]+/)*")
            continue
        text = re.escape(chunk).replace(r"\*", "[^/]*").replace(r"\?", "[^/]")
        parts.append(text if last else f"{text}/")
    return "".join(parts)
