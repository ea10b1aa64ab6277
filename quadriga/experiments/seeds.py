"""Seeds of worlds as text: as they are typed, and as reports show them."""

from __future__ import annotations

from collections.abc import Iterable

from quadriga.shared.errors import ConfigError


def parse_seeds(option: str, text: str) -> tuple[int, ...]:
    """`0:3` is 0, 1, 2; `7` is 7; `1,5,0:3` is all of them, each once.

    Raises:
        ConfigError: something else, or no seed at all.
    """
    seeds: list[int] = []
    for part in text.split(","):
        first, colon, end = part.strip().partition(":")
        if not (first.isdecimal() and (end.isdecimal() if colon else True)):
            raise ConfigError(option, repr(text), "seeds as 0:3 (0, 1, 2), 7, or 1,5,9")
        seeds += range(int(first), int(end) if colon else int(first) + 1)
    if not seeds:
        raise ConfigError(option, repr(text), "at least one seed", "the end of 0:3 is left out")
    return tuple(dict.fromkeys(seeds))


def format_seeds(seeds: Iterable[int]) -> str:
    """`0 … 19, 23`."""
    runs: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if runs and seed == runs[-1][-1] + 1:
            runs[-1].append(seed)
        else:
            runs.append([seed])
    return ", ".join(f"{r[0]} … {r[-1]}" if len(r) > 2 else ", ".join(map(str, r)) for r in runs)
