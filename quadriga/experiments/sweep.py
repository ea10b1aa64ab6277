"""A swept key as it is typed, and its values in order."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from quadriga.experiments.variants import split_outside_brackets
from quadriga.shared.config.load import parse_assignment
from quadriga.shared.errors import ConfigError

_PLACE: Final = re.compile(r"\{([^{}]*)\}")


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


def parse_sweep(option: str) -> Sweep:
    """`section.key=0.04,0.08`, or with the swept part of a text in braces: `push=r1:{80,120}:90`.

    A later `{}` stands for the same value again.

    Raises:
        ConfigError: no key, or no values.
    """
    key, separator, text = option.partition("=")
    places = _PLACE.findall(text)
    labels = tuple(split_outside_brackets(places[0] if places else text, ","))
    if not separator or "." not in key or not labels or any(places[1:]):
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


def order_values(values: Iterable[str]) -> tuple[tuple[float, str], ...]:
    """A sort key of swept values: numbers by size, before texts by letter."""
    return tuple((to_number(value), value) for value in values)


def to_number(value: str) -> float:
    """A swept value as a number; infinite if it is none."""
    try:
        return float(value)
    except ValueError:
        return float("inf")
