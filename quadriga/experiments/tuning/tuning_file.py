"""What is tuned, where and with how many walks: a TOML file, checked once."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.experiments.seeds import parse_seeds
from quadriga.experiments.toml_table import TomlTable
from quadriga.shared.config.load import flatten, read_toml
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

_KEYS: Final = (
    "title", "scenarios", "seeds", "judged_on", "walks", "population", "generations", "step",
    "seed", "fixed", "tuned",
)  # fmt: skip
_DIGITS: Final = 3  # of a tuned value: more would say nothing, and be longer to read
_LEAST_POPULATION: Final = 4
_LARGEST_SEED: Final = 2**32 - 1  # of NumPy's generators
_ELEMENT: Final = re.compile(r"(?P<key>[^\[\]]+)(\[(?P<place>\d{1,4})\])?")


@dataclass(frozen=True, slots=True)
class TunedKey:
    """A number of the configuration that is tuned.

    Attributes:
        name: `section.key`, or `section.key[k]` for an element of a list.
        low, high: the range that is searched.
        logarithmic: whether steps are taken in its logarithm.
    """

    name: str
    low: float
    high: float
    logarithmic: bool

    @property
    def key(self) -> str:
        """`section.key`."""
        return _match(self.name)["key"]

    @property
    def place(self) -> int | None:
        """Of the element; None for a number that is no list."""
        place = _match(self.name)["place"]
        return None if place is None else int(place)

    def value(self, x: float) -> float:
        """The value at a place of the search, 0 … 1 from `low` to `high`, of few digits."""
        low, high = self._scale(self.low), self._scale(self.high)
        place = low + min(1.0, max(0.0, x)) * (high - low)
        return float(f"{math.exp(place) if self.logarithmic else place:.{_DIGITS}g}")

    def x(self, value: float) -> float:
        """The place of a value, 0 … 1.

        Raises:
            ConfigError: it is out of range.
        """
        if not self.low <= value <= self.high:
            raise ConfigError(
                self.name, f"a start of {value:g}", f"within {self.low:g} … {self.high:g}"
            )
        low, high = self._scale(self.low), self._scale(self.high)
        return (self._scale(value) - low) / (high - low)

    def _scale(self, value: float) -> float:
        return math.log(value) if self.logarithmic else value


@dataclass(frozen=True, slots=True)
class Tuning:
    """What a file of `deploy/tuning` says.

    Attributes:
        title: what is tuned.
        scenarios: where each candidate walks.
        seeds: of the worlds; each generation takes the next ones.
        judged_on: seeds that the result is held against the start on.
        walks: of each candidate in each scenario.
        population: candidates of a generation, beside the start.
        generations: how many.
        step: of the first generation, a standard deviation, of the whole range.
        seed: of the search.
        fixed: keys that all candidates share.
        keys: what is tuned.
    """

    title: str
    scenarios: tuple[str, ...]
    seeds: tuple[int, ...]
    judged_on: tuple[int, ...]
    walks: int
    population: int
    generations: int
    step: float
    seed: int
    fixed: Mapping[str, Any]
    keys: tuple[TunedKey, ...]

    def seeds_of(self, generation: int) -> tuple[int, ...]:
        """The seeds of a generation; no two have the same."""
        return self.seeds[generation * self.walks : (generation + 1) * self.walks]

    def changes(self, start: Config, values: Mapping[str, float]) -> dict[str, Any]:
        """Keys of a configuration in which tuned numbers have these values.

        Args:
            start: where elements of lists that are not tuned are taken from.
            values: by name.
        """
        found: dict[str, Any] = dict(self.fixed)
        for key in self.keys:
            if key.place is None:
                found[key.key] = values[key.name]
            else:
                elements = list(found.get(key.key, look_up(start, key.key)))
                elements[key.place] = values[key.name]
                found[key.key] = elements
        return found

    def start_values(self, start: Config) -> dict[str, float]:
        """What a configuration has, by name.

        Raises:
            ConfigError: a key is no number, or out of its range.
        """
        return {key.name: _number(start, key) for key in self.keys}


def read_tuning(path: Path) -> Tuning:
    """The tuning of a file.

    Raises:
        ConfigError: the file cannot be read, or says something that is none.
    """
    table = TomlTable(str(path), read_toml(path), _KEYS)
    tuning = Tuning(
        title=table.text("title"),
        scenarios=table.texts("scenarios", ()),
        seeds=parse_seeds(f"{path}: seeds", table.text("seeds")),
        judged_on=parse_seeds(f"{path}: judged_on", table.text("judged_on")),
        walks=_count(table, "walks", 1),
        population=_count(table, "population", _LEAST_POPULATION),
        generations=_count(table, "generations", 1),
        step=table.number("step"),
        seed=_count(table, "seed", 0, _LARGEST_SEED),
        fixed=flatten(table.mapping("fixed")),
        keys=_read_keys(table),
    )
    _check(tuning, table.where)
    return tuning


def _check(tuning: Tuning, where: str) -> None:
    if not 0.0 < tuning.step <= 1.0:
        raise ConfigError(f"{where}: step", f"{tuning.step:g}", "above 0, at most 1")
    needed = tuning.walks * tuning.generations
    if len(tuning.seeds) < needed:
        raise ConfigError(
            f"{where}: seeds",
            str(len(tuning.seeds)),
            f"{needed}",
            "each generation takes `walks` seeds of its own",
        )
    both = set(tuning.seeds) & set(tuning.judged_on)
    if both:
        raise ConfigError(
            f"{where}: judged_on", f"{min(both)}, which is one of seeds too", "seeds of its own"
        )


def _read_keys(table: TomlTable) -> tuple[TunedKey, ...]:
    names = table.mapping("tuned")
    tuned = table.table("tuned", names)
    keys = []
    for name in names:
        if _ELEMENT.fullmatch(name) is None:
            raise ConfigError(f"{tuned.where}: a key", repr(name), "section.key or section.key[k]")
        mine = tuned.table(name, ("low", "high", "logarithmic"))
        low, high = mine.number("low"), mine.number("high")
        logarithmic = mine.yes("logarithmic", True)
        if not low < high or (logarithmic and low <= 0.0):
            raise ConfigError(
                mine.where,
                f"low {low:g}, high {high:g}",
                "low < high, both above 0" if logarithmic else "low < high",
            )
        keys.append(TunedKey(name, low, high, logarithmic))
    if len(keys) < 2:
        raise ConfigError(f"{table.where}: tuned", f"{len(keys)} keys", "at least two")
    return tuple(keys)


def _count(table: TomlTable, name: str, least: int, most: int | None = None) -> int:
    number = table.number(name)
    if number < least or number != int(number) or (most is not None and number > most):
        upper = "" if most is None else f" and ≤ {most}"
        raise ConfigError(
            f"{table.where}: {name}", f"{number:g}", f"a whole number ≥ {least}{upper}"
        )
    return int(number)


def _match(name: str) -> re.Match[str]:
    match = _ELEMENT.fullmatch(name)
    assert match is not None, name
    return match


def look_up(config: Config, name: str) -> Any:
    """The value of `section.key`.

    Raises:
        ConfigError: there is no such key.
    """
    section, _, key = name.partition(".")
    try:
        return getattr(getattr(config, section), key)
    except AttributeError:
        raise ConfigError(f"tuned: {name}", "no such key", "section.key") from None


def _number(config: Config, key: TunedKey) -> float:
    value = look_up(config, key.key)
    if key.place is not None:
        if not isinstance(value, tuple) or key.place >= len(value):
            raise ConfigError(f"tuned: {key.name}", repr(value), "an element of a list")
        value = value[key.place]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ConfigError(f"tuned: {key.name}", repr(value), "a number")
    key.x(float(value))
    return float(value)
