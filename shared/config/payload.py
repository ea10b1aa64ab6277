"""Who carries the load: the grammar of `world.payload_on`."""

from __future__ import annotations

import math
from typing import Final

from quadriga.shared.errors import ConfigError

_KEY: Final = "world.payload_on"
_GRAMMAR: Final = "'team', or robots with their shares, as 'r2' or 'r1:6,r3:4'"


def carriers(text: str, names: tuple[str, ...]) -> tuple[float, ...]:
    """Parts of the load that the robots of `names` carry; what counts is their proportion.

    Raises:
        ConfigError: the text does not follow the grammar, or names a robot not in `names`.
    """
    if text == "team":
        return (1.0,) * len(names)
    weights: dict[str, float] = {}
    for part in text.split(","):
        robot, colon, weight = (word.strip() for word in part.partition(":"))
        if robot not in names:
            raise ConfigError(_KEY, repr(robot), f"'team' or one of {', '.join(names)}")
        if robot in weights:
            raise ConfigError(_KEY, f"{robot} twice in {text!r}", _GRAMMAR)
        weights[robot] = _weight(weight, part) if colon else 1.0
    return tuple(weights.get(name, 0.0) for name in names)


def _weight(word: str, part: str) -> float:
    try:
        weight = float(word)
    except ValueError:
        weight = math.nan
    if not 1e-3 <= weight <= 1e3:  # this way round, it refuses what is not a number, too
        raise ConfigError(_KEY, repr(part), _GRAMMAR, "a share is a number of 0.001 … 1000")
    return weight
