"""The name of every number in a message, for readers that know nothing of this project."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import Field, dataclass, fields
from typing import Any, Final

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Message
from quadriga.shared.robots.conventions import Array, robot_names, yoke_pairs

_SAMPLES: Final = "N"  # the axis of the horizon: one row per entry


@dataclass(frozen=True, slots=True)
class MessageLayout:
    """What one kind of message holds, in a recording of one team.

    Attributes:
        kind: the type of the messages.
        plain: fields that are one number or text.
        numbers: names of the entries of all arrays and maps, parts joined by dots, in the order
            in which `numbers_of` gives them.
        lists: fields that are lists of numbers of any length.
    """

    kind: type[Message]
    plain: tuple[tuple[str, type], ...]
    numbers: tuple[str, ...]
    lists: tuple[str, ...]
    _arrays: tuple[str, ...]
    _maps: tuple[tuple[str, tuple[str, ...]], ...]

    def numbers_of(self, message: Any) -> Array | None:
        """The entries of all arrays and maps, NaN where a map has no such entry.

        Returns:
            Shape (rows, len(numbers)), one row per sample of a plan and a single one for
            everything else; None if the message is about another team.
        """
        arrays = [np.asarray(getattr(message, name)) for name in self._arrays]
        rows = len(arrays[0]) if self.by_sample else 1
        parts = [array.reshape(rows, -1) for array in arrays if rows]
        for name, entries in self._maps:
            known = getattr(message, name)
            row = [[float(known.get(entry, np.nan)) for entry in entries]]
            parts.append(np.repeat(row, rows, axis=0))
        if not rows:  # a plan of nothing
            return np.zeros((0, len(self.numbers)))
        numbers: Array = np.concatenate(parts, axis=1) if parts else np.zeros((rows, 0))
        return numbers if numbers.shape[1] == len(self.numbers) else None

    @property
    def sampled(self) -> int:
        """How many of `numbers`, from the first on, differ from sample to sample."""
        maps = sum(len(entries) for _, entries in self._maps)
        return len(self.numbers) - maps if self.by_sample else 0

    @property
    def by_sample(self) -> bool:
        """Whether a message has one row per sample of the horizon."""
        return any(item.metadata.get("shape", ("",))[0] == _SAMPLES for item in fields(self.kind))


def list_owners(config: Config) -> dict[str, tuple[str, ...]]:
    """Names along the first axis of an array of all robots (`n`) and of all yokes (`k`)."""
    robots = robot_names(config.team.robots)
    pairs = yoke_pairs(len(robots), config.team.yokes)
    return {"n": robots, "k": tuple(f"{robots[i]}-{robots[j]}" for i, j in pairs)}


def name_numbers(item: Field[Any], owners: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Names of the numbers of an array's field: those of one sample, if it is of several.

    Args:
        item: the field.
        owners: see `list_owners`.
    """
    of = owners.get(item.metadata["shape"][0], ("",))
    entries = item.metadata["entries"]
    return [".".join((owner, item.name, entry)).strip(".") for owner in of for entry in entries]


def build_layout(
    kind: type[Message], config: Config, entries: Mapping[str, tuple[str, ...]]
) -> MessageLayout:
    """The layout of a kind of message.

    Args:
        kind: the type.
        config: the recorded configuration: robots and yokes.
        entries: for each field that is a map, the names that occur in it.
    """
    owners = list_owners(config)
    plain, numbers, lists, arrays, maps = [], list[str](), [], [], []
    for item in fields(kind):
        shape, of = item.metadata.get("shape"), item.metadata.get("kind")
        if shape is None:
            if of is dict:
                maps.append((item.name, entries.get(item.name, ())))
            elif of in (bool, int, float, str) and item.name not in ("tick", "stamp_ns"):
                plain.append((item.name, of))
        elif not item.metadata["entries"]:
            lists.append(item.name)
        else:
            arrays.append(item.name)
            numbers += name_numbers(item, owners)
    for name, among in maps:
        numbers += name_entries(name, among)
    return MessageLayout(
        kind, tuple(plain), tuple(numbers), tuple(lists), tuple(arrays), tuple(maps)
    )


def name_entries(field: str, entries: tuple[str, ...]) -> list[str]:
    """Names for the entries of a map, whatever a sender called them: plan.r1 becomes plan_r1."""
    names: list[str] = []
    for entry in entries:
        name = f"{field}.{re.sub(r'[^A-Za-z0-9_-]', '_', entry) or '_'}"
        while name in names:
            name += "_"
        names.append(name)
    return names
