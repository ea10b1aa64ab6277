"""Variants that walk in the same worlds: planners and predictors by name, or any set of keys."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.agents.predictor.predictor import KINDS
from quadriga.shared.agent_command import KEY as CONTROLLER
from quadriga.shared.config.load import flatten, parse_assignment, read_toml
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import BUILT_IN, find_kind, installed_kinds

Keys = Mapping[str, Any]  # values by section.key

_NAME: Final = re.compile(r"[A-Za-z0-9_.+-]{1,40}")
_CLOSING: Final = {"[": "]", "{": "}", '"': '"', "'": "'"}


@dataclass(frozen=True, slots=True)
class Variant:
    """A named set of keys that is compared with others: a planner, or any other change."""

    name: str
    keys: Keys


def _planner(
    kind: str, compensation: bool = False, damping: float = 0.0, exchanges: int = 0
) -> Keys:
    return {
        "planner.kind": kind,
        "planner.compensation": compensation,
        "planner.damping": damping,
        "planner.exchanges": exchanges,
    }


_BY_TEAM: Final = -1.0  # damping that the size of the team chooses
PLANNERS: Final[Mapping[str, Keys]] = {
    "none": _planner("none"),
    "decentralised": _planner("decentralised"),
    "distributed": _planner("distributed", True, _BY_TEAM),  # as by default
    "uncompensated": _planner("distributed", False, _BY_TEAM),
    "undamped": _planner("distributed", True),
    "damped": _planner("distributed", True, 0.5),
    "exchanged": _planner("distributed", True, _BY_TEAM, exchanges=2),
    "cooperative": {**_planner("distributed", exchanges=8), "planner.cost": "team"},
    "centralised": _planner("centralised"),
    "deepc": _planner("deepc"),
    "configured": {},  # the planner of the configuration, whatever it is
}
_THROUGH: Final[Keys] = {"identification.max_radius": 10.0, "identification.max_peers_harm": 1e3}
# The plain ones are let through the gates that refuse them: without block weights the distributed
# scheme iterates with a radius above 1, and with effects of peers that are not there. What then
# happens is worth seeing.
PREDICTORS: Final[Mapping[str, Keys]] = {
    **{kind: {"identification.predictor": kind} for kind in KINDS},
    "plain": {"identification.predictor": "ridge", "identification.block_weight": 1.0, **_THROUGH},
    "paper": {"identification.predictor": "pinv", **_THROUGH},
}


def parse_variants(options: Sequence[str], file: Path | None) -> tuple[Variant, ...]:
    """Variants by `--planners`, those of `--variants` included.

    Args:
        options: texts such as `none,distributed,stiff:controller.kp_z=800;controller.kd_z=60`;
            none takes every variant of the file.
        file: TOML with one table of keys for each variant, or None.

    Raises:
        ConfigError: a name that nothing explains or that is given twice, or none at all.
    """
    from_file = {} if file is None else read_keys(read_toml(file), str(file))
    plugins = {kind: _planner(kind) for kind in installed_kinds() if kind not in BUILT_IN}
    known: dict[str, Keys] = {**plugins, **PLANNERS, **from_file}
    named: dict[str, Keys] = {}
    for text in [part for o in options for part in split_outside_brackets(o, ",")] or from_file:
        name, colon, keys = text.partition(":")
        if colon and not _NAME.fullmatch(name):
            raise ConfigError("--planners", repr(name), "a name of up to 40 letters, digits, _.+-")
        if not colon and name not in known:
            raise ConfigError(
                "--planners",
                repr(name),
                f"names of {', '.join(known)}",
                "or name:section.key=value;section.key=value",
            )
        if name in named:
            raise ConfigError("--planners", f"{name} twice", "different names")
        named[name] = _parse_keys(keys) if colon else known[name]
    if not named:
        raise ConfigError("--planners", "none", f"at least one of {', '.join(known)}")
    return tuple(Variant(name, keys) for name, keys in named.items())


def combine_with_predictors(
    variants: Sequence[Variant], predictors: Sequence[str]
) -> tuple[Variant, ...]:
    """Each variant with each predictor, as `planner+predictor`; one without a planner as it is.

    Raises:
        ConfigError: a name is none of `PREDICTORS`, or stands there twice; or a variant's kind of
            planner is not installed.
    """
    for name in predictors:
        if name not in PREDICTORS:
            raise ConfigError("--predictors", repr(name), f"names of {', '.join(PREDICTORS)}")
    if len(set(predictors)) < len(predictors):
        raise ConfigError("--predictors", ", ".join(predictors), "each once")
    combined: list[Variant] = []
    for variant in variants:
        kind = variant.keys.get("planner.kind")
        own = not variant.keys.get(CONTROLLER)
        if not predictors or not own or (kind is not None and not find_kind(kind).needs_predictor):
            combined.append(variant)
            continue
        for name in predictors:
            keys = {**variant.keys, **PREDICTORS[name]}
            combined.append(Variant(f"{variant.name}+{name}", keys))
    return tuple(combined)


def read_keys(tables: Mapping[str, Any], where: str) -> dict[str, Keys]:
    """Values by `section.key` of each table of a file.

    Raises:
        ConfigError: what has a name is no table, or the name is not a plain one; `where` it stands.
    """
    for name, keys in tables.items():
        if not _NAME.fullmatch(name) or not isinstance(keys, dict):
            raise ConfigError(f"{where}: {name}", "no table of a plain name", "[name] and its keys")
    return {name: flatten(keys) for name, keys in tables.items()}


def split_outside_brackets(text: str, mark: str) -> list[str]:
    """Parts between marks that stand in no bracket and no quotation; empty ones are left out."""
    return [part.strip() for part in _split(text, mark) if part.strip()]


def _parse_keys(text: str) -> Keys:
    parts = split_outside_brackets(text, ";")
    return dict(parse_assignment(part, "--planners") for part in parts)


def _split(text: str, mark: str) -> Iterator[str]:
    begin, closing = 0, ""
    for k, letter in enumerate(text):
        if closing:
            closing = "" if letter == closing else closing
        elif letter in _CLOSING:
            closing = _CLOSING[letter]
        elif letter == mark:
            yield text[begin:k]
            begin = k + 1
    yield text[begin:]
