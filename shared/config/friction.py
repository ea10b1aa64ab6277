"""Robots that find another friction than the others: the grammar of `world.friction_of`."""

from __future__ import annotations

import math
from typing import Final

from quadriga.shared.errors import ConfigError

_KEY: Final = "world.friction_of"
_GRAMMAR: Final = "robots with the friction that they find, as 'r2:0.3' or 'r1:0.3,r3:0.5'"
_LEAST, _MOST = 0.05, 2.0  # as of `world.friction`


def friction_of_robots(text: str, usual: float, names: tuple[str, ...]) -> tuple[float, ...]:
    """The friction coefficient that each robot of `names` finds under its feet.

    Args:
        text: of the key; empty: the usual one for all.
        usual: that of all robots that the text does not name.
        names: of the team's robots.

    Raises:
        ConfigError: the text does not follow the grammar, names a robot twice, or one not in
            `names`; or a coefficient is not within the bounds of `world.friction`.
    """
    found: dict[str, float] = {}
    for part in text.split(",") if text else ():
        robot, _, word = (each.strip() for each in part.partition(":"))
        if robot not in names:
            raise ConfigError(_KEY, repr(robot), f"one of {', '.join(names)}")
        if robot in found:
            raise ConfigError(_KEY, f"{robot} twice in {text!r}", _GRAMMAR)
        found[robot] = _read_friction(word, part)
    return tuple(found.get(name, usual) for name in names)


def _read_friction(word: str, part: str) -> float:
    try:
        friction = float(word)
    except ValueError:
        friction = math.nan
    if not _LEAST <= friction <= _MOST:  # this way round, it refuses what is not a number, too
        cause = f"a coefficient is a number of {_LEAST} … {_MOST:g}"
        raise ConfigError(_KEY, repr(part), _GRAMMAR, cause)
    return friction
