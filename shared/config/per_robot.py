"""Numbers of single robots, as `r1:6,r3:4`: the grammar of `payload_on` and of `friction_of`."""

from __future__ import annotations

import math

from quadriga.shared.errors import ConfigError


def carriers(text: str, names: tuple[str, ...]) -> tuple[float, ...]:
    """Parts of the load that the robots of `names` carry; what counts is their proportion.

    Raises:
        ConfigError: the text does not follow the grammar, or names a robot not in `names`.
    """
    if text == "team":
        return (1.0,) * len(names)
    found = _read("world.payload_on", text, names, (1e-3, 1e3), bare="1")
    return tuple(found.get(name, 0.0) for name in names)


def friction_of_robots(text: str, usual: float, names: tuple[str, ...]) -> tuple[float, ...]:
    """The friction coefficient that each robot of `names` finds under its feet.

    It is the `usual` one for all robots that the text does not name.

    Raises:
        ConfigError: as `carriers`, or a coefficient is not within the bounds of `world.friction`.
    """
    found = _read("world.friction_of", text, names, (0.05, 2.0)) if text else {}
    return tuple(found.get(name, usual) for name in names)


def _read(
    key: str, text: str, names: tuple[str, ...], limits: tuple[float, float], bare: str = ""
) -> dict[str, float]:
    """Numbers by robot; a robot without a number has the `bare` one."""
    found: dict[str, float] = {}
    for part in text.split(","):
        robot, colon, word = (each.strip() for each in part.partition(":"))
        if robot not in names or robot in found:
            got = f"{robot} twice in {text!r}" if robot in found else repr(robot)
            raise ConfigError(key, got, f"each at most once of {', '.join(names)}")
        try:
            found[robot] = float(word if colon else bare)
        except ValueError:
            found[robot] = math.nan
        low, high = limits
        if not low <= found[robot] <= high:  # this way round, it refuses what is no number, too
            raise ConfigError(key, repr(part), f"ROBOT:NUMBER, a number of {low:g} … {high:g}")
    return found
