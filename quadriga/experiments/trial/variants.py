"""What can be compared, by name: planners, predictors and scenarios as sets of keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

from quadriga.agents.predictor.fits import FITS
from quadriga.shared.config.load import build
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

Keys = Mapping[str, Any]  # values by section.key
Variants = Mapping[str, Keys]

CONFIGURED: Final = "configured"  # the planner of the configuration, whatever it is


def _planner(
    kind: str, compensation: bool = False, damping: float = 0.0, exchanges: int = 0
) -> Keys:
    return {
        "planner.kind": kind,
        "planner.compensation": compensation,
        "planner.damping": damping,
        "planner.exchanges": exchanges,
    }


PLANNERS: Final[Variants] = {
    "none": _planner("none"),
    "decentralised": _planner("decentralised"),
    "distributed": _planner("distributed"),
    "compensated": _planner("distributed", compensation=True),
    "damped": _planner("distributed", damping=0.5),
    "exchanged": _planner("distributed", exchanges=2),
    "centralised": _planner("centralised"),
    "deepc": _planner("deepc"),
    CONFIGURED: {},
}
# The plain ones are let through a gate that refuses them: without block weights the distributed
# scheme iterates with a radius above 1, and what then happens is worth seeing.
PREDICTORS: Final[Variants] = {
    **{kind: {"identification.predictor": kind} for kind in FITS},
    "plain": {
        "identification.predictor": "ridge",
        "identification.block_weight": 1.0,
        "identification.max_radius": 10.0,
    },
    "paper": {"identification.predictor": "pinv", "identification.max_radius": 10.0},
}
SCENARIOS: Final[Variants] = {
    "flat": {"world.terrain": "flat", "world.payload": 0.0, "world.push": ""},
    "boxes": {
        "world.terrain": "boxes",
        "world.terrain_height": 0.04,
        "world.payload": 4.5,
        "world.payload_on": "team",
        "world.push": "",
    },
    "push": {"world.terrain": "flat", "world.payload": 0.0, "world.push": "r1:80:90:3:0.2"},
}


def with_keys(config: Config, keys: Keys) -> Config:
    """The configuration with some keys replaced.

    Raises:
        ConfigError: an unknown key, or a value that it does not take.
    """
    given = asdict(config)
    for name, value in keys.items():
        section, _, key = name.partition(".")
        given[section][key] = value
    return build(given)


def named_as(config: Config, variants: Variants) -> str:
    """The variant that the configuration already is; `CONFIGURED` if it is none."""
    return next(
        (name for name, keys in variants.items() if with_keys(config, keys) == config), CONFIGURED
    )


def chosen(option: str, names: str, variants: Variants) -> tuple[str, ...]:
    """Names separated by commas, each once, in the order given.

    Raises:
        ConfigError: one is no name of a variant, or there is none.
    """
    found = tuple(dict.fromkeys(filter(None, (name.strip() for name in names.split(",")))))
    for name in found:
        if name not in variants:
            raise ConfigError(option, repr(name), f"names of {', '.join(variants)}")
    if not found:
        raise ConfigError(option, repr(names), f"at least one of {', '.join(variants)}")
    return found


def seeds_of(option: str, span: str) -> tuple[int, ...]:
    """`0:3` is 0, 1, 2; `7` is 7; `1,5,0:3` is all of them, each once.

    Raises:
        ConfigError: something else, or no seed at all.
    """
    seeds: list[int] = []
    for part in span.split(","):
        first, colon, end = part.strip().partition(":")
        if not (first.isdecimal() and (end.isdecimal() if colon else True)):
            raise ConfigError(option, repr(span), "seeds as 0:3 (0, 1, 2), 7, or 1,5,9")
        seeds += range(int(first), int(end) if colon else int(first) + 1)
    if not seeds:
        raise ConfigError(option, repr(span), "at least one seed", "the end of 0:3 is left out")
    return tuple(dict.fromkeys(seeds))
