"""All messages of one key as arrays: by field, by number, or as a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from quadriga.api.frames import build_frame
from quadriga.shared.errors import RecordingError, did_you_mean

if TYPE_CHECKING:
    from pandas import DataFrame

SAMPLES: Final = "N"  # the axis of a plan's horizon
_JOINT: Final = "_joint"  # which need not be written: state["q"] is state["q_joint"]
_SHOWN: Final = 3  # fields that are named in short


@dataclass(frozen=True, slots=True)
class TopicField:
    """One field of the messages of a key.

    Attributes:
        name: as the wire has it.
        shape: of one message, () of a single value; a letter is a length that the message chooses:
            `N` samples of a horizon, `n` robots, `k` yokes.
        unit: of its numbers, "" of text.
        frame: that they are in, "" where it does not say.
        numbers: the name of each number, as `TopicArrays.frame` calls its columns; () of text, and
            of lists of any length.
        doc: what it is, in words; "" where its name says so.
    """

    name: str
    shape: tuple[int | str, ...]
    unit: str
    frame: str
    numbers: tuple[str, ...]
    doc: str = ""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TopicArrays:
    """Every message of one key, in the order of the recording: T of them.

    Example:
        >>> state = run["r1/state"]
        >>> print(state["q_joint"].shape, state.fields["q_joint"].unit)
        (10000, 12) rad

    Attributes:
        key: without the team's name, such as `r1/state`.
        tick: world time of each message, shape (T,), ms.
        log_time_ns: when the recorder heard it, or a plant sent or took in a state or command, by
            the wall clock, shape (T,), ns since 1970.
        fields: what the messages hold, by name, with units and frames.
        invalid: how many more messages there were that are none of this topic; they are left out.
        arrays: of each field, see `__getitem__`.
    """

    key: str
    tick: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    fields: Mapping[str, TopicField]
    invalid: int
    arrays: Mapping[str, NDArray[Any]]

    @property
    def shape(self) -> tuple[int, int]:
        """How many messages, and how many numbers each holds (those of the longest)."""
        numbers = (prod(array.shape[1:]) for array in self.arrays.values() if array.dtype != object)
        return len(self.tick), sum(numbers)

    @property
    def time(self) -> NDArray[np.float64]:
        """World time of each message, shape (T,), s."""
        return self.tick / 1000.0

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A field of all messages, or one of its numbers.

        Example:
            >>> state["q_joint"].shape, state["q_joint.FL_hip"].shape
            ((10000, 12), (10000,))

        Args:
            name: one of `fields`, whose ending `_joint` may be left out, or of its `numbers`.

        Returns:
            Shape (T, …) as the field says; (T,) of a single value or number; (T, N) of a number of
            every sample of a plan. Where messages differ in length, what the shorter ones lack is
            NaN, and so is an entry that a map does not have.

        Raises:
            RecordingError: there is no such field or number.
        """
        for known in (name, f"{name}{_JOINT}"):
            if known in self.arrays:
                return self.arrays[known]
        for field in self.fields.values():
            if name in field.numbers:
                array = self.arrays[field.name]
                ahead = array.shape[: 2 if SAMPLES in field.shape else 1]
                return array.reshape(*ahead, len(field.numbers))[..., field.numbers.index(name)]
        every = [*self.fields, *(one for field in self.fields.values() for one in field.numbers)]
        raise RecordingError(
            f"a field of {self.key}",
            repr(name),
            f"one of {', '.join(self.fields)}, or a number of it",
            did_you_mean(name, every),
        )

    def frame(self) -> DataFrame:
        """All of it as a table: a row for each message, and of a plan for each of its samples.

        Example:
            >>> state = run["r1/state"].frame()
            >>> state["q_joint.FL_hip"].plot()

        Returns:
            A pandas.DataFrame. Its index is `tick` [ms], of a plan `tick` and `sample`; its columns
            are the `numbers` of all fields, texts, and lists.

        Raises:
            ConfigError: pandas is not installed; the extra `frame` has it.
        """
        rows = np.arange(len(self.tick))
        samples: NDArray[np.intp] | None = None
        planned = [field for field in self.fields.values() if SAMPLES in field.shape]
        if planned:
            there = ~np.isnan(self.arrays[planned[0].name][..., 0])
            rows, samples = np.nonzero(there)
        columns: dict[str, Any] = {}
        for name, field in self.fields.items():
            whole = SAMPLES not in field.shape or samples is None
            values = self.arrays[name][rows] if whole else self.arrays[name][rows, samples]
            if field.numbers:
                flat = values.reshape(len(rows), len(field.numbers))
                columns |= dict(zip(field.numbers, flat.T, strict=True))
            elif not field.shape:
                columns[name] = values
            elif isinstance(field.shape[0], str):  # a list of any length
                columns[name] = [row[~np.isnan(row)] for row in values]
        index: dict[str, NDArray[Any]] = {"tick": self.tick[rows]}
        if samples is not None:
            index["sample"] = samples
        return build_frame(columns, index)

    def __len__(self) -> int:
        """How many messages."""
        return len(self.tick)

    def __iter__(self) -> Iterator[str]:
        """Names of the fields."""
        return iter(self.fields)

    def __repr__(self) -> str:
        """The key, and what its messages hold."""
        names = [*self.fields][:_SHOWN]
        more = ", …" if len(self.fields) > _SHOWN else ""
        return f"TopicArrays({self.key!r}, shape={self.shape}, fields={', '.join(names)}{more})"
