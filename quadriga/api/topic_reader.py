"""From the messages of one key to arrays: nothing else of a recording is decoded."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from quadriga.api.topic_arrays import TopicArrays, TopicField
from quadriga.export.layout import list_owners, name_entries, name_numbers
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Message
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import Topic, find_topic

_BATCH: Final = 4096  # messages that are in memory as such
_UNIT: Final = re.compile(r" \[([^\[\]]*)\]$")  # at the end of what a single value is
_DTYPES: Final[Mapping[type, Any]] = {bool: np.bool_, int: np.int64, float: np.float64}

Owners = Mapping[str, tuple[str, ...]]
Arrays = dict[str, NDArray[Any]]


def find_key(config: Config, name: str) -> tuple[str, Topic | None, str]:
    """The key that a name means, with or without the team's, its topic, and the robot's name."""
    for key in (f"{config.team.name}/{name}", name):
        topic, robot = find_topic(key)
        if topic is not None:
            return key, topic, robot
    return name, None, ""


def read_topic(recording: Recording, config: Config, key: str, topic: Topic) -> TopicArrays:
    """All messages of a key.

    Args:
        recording: where they are.
        config: its configuration.
        key: with the team's name.
        topic: of the key.

    Raises:
        RecordingError: the messages are of a schema later than this version's.
    """
    owners, kind = list_owners(config), topic.type
    sizes = _sizes_of(kind, owners)
    ticks: list[int] = []
    log_times: list[int] = []
    batch: list[Message] = []
    parts: list[Arrays] = []
    invalid = 0
    for entry in recording.entries(keys={key}):
        message = _decode_fitting(entry.payload, kind, sizes)
        if message is None:
            invalid += 1
            continue
        ticks.append(message.tick)
        log_times.append(entry.log_time_ns)
        batch.append(message)
        if len(batch) == _BATCH:
            parts.append(_stack_batch(kind, batch, owners))
            batch = []
    parts.append(_stack_batch(kind, batch, owners))
    arrays = {name: join_padded([part[name] for part in parts]) for name in parts[0]}
    described = {}
    for item in _fields_of(kind):
        entries: tuple[str, ...] = ()
        if item.metadata.get("kind") is dict:
            entries, arrays[item.name] = tabulate(arrays[item.name])
        described[item.name] = _describe(item, owners, entries)
    return TopicArrays(
        key.removeprefix(f"{config.team.name}/"),
        np.array(ticks, dtype=np.int64),
        np.array(log_times, dtype=np.int64),
        described,
        invalid,
        arrays,
    )


def _fields_of(kind: type[Message]) -> list[Field[Any]]:
    """Fields of a message but for its times."""
    return [item for item in fields(kind) if item.name not in ("tick", "stamp_ns")]


def _sizes_of(kind: type[Message], owners: Owners) -> dict[str, int]:
    """Fields of which a message has a row for each robot or yoke, and how many those are."""
    first = {item.name: item.metadata.get("shape", ("",))[0] for item in _fields_of(kind)}
    return {name: len(owners[symbol]) for name, symbol in first.items() if symbol in owners}


def _decode_fitting(
    payload: bytes, kind: type[Message], sizes: Mapping[str, int]
) -> Message | None:
    """The message, None if its bytes are none or it is about another team."""
    try:
        message = decode(payload, kind)
    except MessageError:
        return None
    fits = all(len(getattr(message, name)) == size for name, size in sizes.items())
    return message if fits else None


def _stack_batch(kind: type[Message], batch: Sequence[Message], owners: Owners) -> Arrays:
    """Some messages by field, along a new first axis."""
    stacked: Arrays = {}
    for item in _fields_of(kind):
        values = [getattr(message, item.name) for message in batch]
        shape = item.metadata.get("shape")
        if shape is not None:
            sizes = [len(owners.get(d, ())) if isinstance(d, str) else d for d in shape]
            stacked[item.name] = join_padded([np.zeros((0, *sizes)), *_stack(values)])
        elif item.metadata["kind"] in _DTYPES:
            stacked[item.name] = np.array(values, dtype=_DTYPES[item.metadata["kind"]])
        else:
            stacked[item.name] = _objects(values)
    return stacked


def _stack(values: Sequence[NDArray[Any]]) -> list[NDArray[Any]]:
    """All of them in one array where their shapes are equal, else each with an axis ahead."""
    if len({value.shape for value in values}) == 1:
        return [np.stack(values)]
    return [value[None] for value in values]


def _objects(values: Sequence[Any]) -> NDArray[Any]:
    """Texts, lists and maps, one object each: NumPy would take a list apart."""
    objects = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        objects[place] = value
    return objects


def join_padded(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Arrays along their first axis; what shorter ones lack along the others is NaN."""
    sizes = np.max([part.shape[1:] for part in parts], axis=0, initial=0)
    padded = []
    for part in parts:
        if part.ndim > 1 and tuple(sizes) != part.shape[1:]:
            wider = np.full((len(part), *sizes), np.nan)
            wider[tuple(map(slice, part.shape))] = part
            part = wider
        padded.append(part)
    return np.concatenate(padded)


def tabulate(maps: NDArray[Any]) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Names that occur in T maps, and their values, shape (T, k), NaN where there is none."""
    names = tuple(sorted({name for one in maps for name in one}))
    rows = [[one.get(name, np.nan) for name in names] for one in maps]
    return names, np.array(rows, dtype=np.float64).reshape(len(maps), len(names))


def _describe(item: Field[Any], owners: Owners, entries: tuple[str, ...]) -> TopicField:
    """What a field is; `entries` are the names in its maps, if it is one."""
    about = item.metadata
    if "shape" in about:
        numbers = tuple(name_numbers(item, owners)) if about["entries"] else ()
        frame = "" if about["frame"] == "-" else about["frame"]
        return TopicField(item.name, about["shape"], about["unit"], frame, numbers)
    unit = _UNIT.search(about["doc"])
    shape: tuple[int, ...] = (len(entries),) if about["kind"] is dict else ()
    numbers = tuple(name_entries(item.name, entries))
    if about["kind"] in _DTYPES:
        numbers = (item.name,)
    return TopicField(item.name, shape, unit[1] if unit else "", "", numbers, about["doc"])
