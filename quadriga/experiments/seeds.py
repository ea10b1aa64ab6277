"""Seeds of worlds as text: as they are typed, and as reports show them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from quadriga.shared.errors import ConfigError

_MOST: Final = 1_000_000  # seeds: more walks than anybody can wait for
_DIGITS: Final = 15  # of one


def parse_seeds(option: str, text: str) -> tuple[int, ...]:
    """`0:3` is 0, 1, 2; `7` is 7; `1,5,0:3` is all of them, each once.

    Raises:
        ConfigError: something else, no seed at all, or more than a million.
    """
    seeds: list[int] = []
    for part in text.split(","):
        first, colon, end = part.strip().partition(":")
        if not (_is_seed(first) and (_is_seed(end) if colon else True)):
            raise ConfigError(option, repr(text), "seeds as 0:3 (0, 1, 2), 7, or 1,5,9")
        more = range(int(first), int(end) if colon else int(first) + 1)
        if len(seeds) + len(more) > _MOST:
            raise ConfigError(option, repr(text), f"at most {_MOST:,} seeds")
        seeds += more
    if not seeds:
        raise ConfigError(option, repr(text), "at least one seed", "the end of 0:3 is left out")
    return tuple(dict.fromkeys(seeds))


def _is_seed(text: str) -> bool:
    return text.isdecimal() and len(text) <= _DIGITS


def format_seeds(seeds: Iterable[int]) -> str:
    """`0 … 19, 23`."""
    runs: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if runs and seed == runs[-1][-1] + 1:
            runs[-1].append(seed)
        else:
            runs.append([seed])
    return ", ".join(f"{r[0]} … {r[-1]}" if len(r) > 2 else ", ".join(map(str, r)) for r in runs)
