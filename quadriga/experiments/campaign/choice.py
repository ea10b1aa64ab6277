"""What a campaign is asked to compare, as typed: variants and swept keys."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.experiments.trial.variants import PLANNERS, Keys
from quadriga.shared.config.load import flatten, parse_assignment, read_toml
from quadriga.shared.errors import ConfigError

_NAME: Final = re.compile(r"[A-Za-z0-9_.+-]{1,40}")
_PLACE: Final = re.compile(r"\{([^{}]*)\}")
_CLOSING: Final = {"[": "]", "{": "}", '"': '"', "'": "'"}


@dataclass(frozen=True, slots=True)
class Variant:
    """A named set of keys that is compared with others: a planner, or any other change."""

    name: str
    keys: Keys


@dataclass(frozen=True, slots=True)
class Sweep:
    """A key that takes several values.

    Attributes:
        key: as section.key.
        pattern: the text in which `{}` stands for what is swept; empty for the value itself.
        values: by what is swept, as text: a number where it can be drawn.
    """

    key: str
    pattern: str
    values: tuple[tuple[str, Any], ...]

    @property
    def name(self) -> str:
        """The axis of a figure."""
        return f"{self.key} = {self.pattern}" if self.pattern else self.key


def variants_of(options: Sequence[str], file: Path | None) -> tuple[Variant, ...]:
    """Variants by `--planners`, those of `--variants` included.

    Args:
        options: texts such as `none,distributed,stiff:controller.kp_z=800;controller.kd_z=60`;
            none takes every variant of the file.
        file: TOML with one table of keys for each variant, or None.

    Raises:
        ConfigError: a name that nothing explains or that is given twice, or none at all.
    """
    known: dict[str, Keys] = dict(PLANNERS)
    mine = {} if file is None else keys_of(read_toml(file), str(file))
    known |= mine
    found: dict[str, Keys] = {}
    for text in [part for option in options for part in parted(option, ",")] or list(mine):
        name, colon, keys = text.partition(":")
        if not _NAME.fullmatch(name):
            raise ConfigError("--planners", repr(name), "a name of up to 40 letters, digits, _.+-")
        if not colon and name not in known:
            raise ConfigError(
                "--planners",
                repr(name),
                f"names of {', '.join(known)}",
                "or name:section.key=value;section.key=value",
            )
        if name in found:
            raise ConfigError("--planners", f"{name} twice", "different names")
        found[name] = (
            dict(parse_assignment(one, "--planners") for one in parted(keys, ";"))
            if colon
            else known[name]
        )
    if not found:
        raise ConfigError("--planners", "none", f"at least one of {', '.join(known)}")
    return tuple(Variant(name, keys) for name, keys in found.items())


def sweep_of(option: str) -> Sweep:
    """`section.key=0.04,0.08`, or with the swept part of a text in braces: `push=r1:{80,120}:90`.

    A later `{}` stands for the same value again.

    Raises:
        ConfigError: no key, or no values.
    """
    key, found, text = option.partition("=")
    places = _PLACE.findall(text)
    labels = tuple(parted(places[0] if places else text, ","))
    if not found or "." not in key or not labels or any(places[1:]):
        raise ConfigError(
            "--sweep",
            repr(option),
            "section.key=value,value",
            "or section.key=text{value,value}text, with {} for it again",
        )
    if len(set(labels)) < len(labels):
        raise ConfigError("--sweep", repr(option), "different values")
    if not places:
        values = [parse_assignment(f"{key}={label}", "--sweep")[1] for label in labels]
        return Sweep(key.strip(), "", tuple(zip(labels, values, strict=True)))
    pattern = _PLACE.sub("{}", text)
    filled = tuple((label, pattern.replace("{}", label)) for label in labels)
    return Sweep(key.strip(), pattern, filled)


def parted(text: str, mark: str) -> list[str]:
    """Parts between marks that stand in no bracket and no quotation; empty ones are left out."""
    return [part for part in (part.strip() for part in _parts(text, mark)) if part]


def _parts(text: str, mark: str) -> Iterator[str]:
    begun, awaited = 0, ""
    for k, letter in enumerate(text):
        if awaited:
            awaited = "" if letter == awaited else awaited
        elif letter in _CLOSING:
            awaited = _CLOSING[letter]
        elif letter == mark:
            yield text[begun:k]
            begun = k + 1
    yield text[begun:]


def keys_of(tables: Mapping[str, Any], where: str) -> dict[str, Keys]:
    """Values by `section.key` of each table of a file.

    Raises:
        ConfigError: what has a name is no table, or the name is not a plain one; `where` it stands.
    """
    for name, keys in tables.items():
        if not _NAME.fullmatch(name) or not isinstance(keys, dict):
            raise ConfigError(f"{where}: {name}", "no table of a plain name", "[name] and its keys")
    return {name: flatten(keys) for name, keys in tables.items()}
