"""Numbers of one type that lie scattered over a packet, read and written at once.

numpy takes a microsecond for each field of a struct, and a packet has dozens. The bytes of all
numbers of a type are gathered instead, by places that are worked out once.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Raw = NDArray[np.uint8]


class Fields:
    """Numbers of a layout that have one type.

    Args:
        layout: of the packet.
        members: what to read, each by its path, such as `motor__q`, with the order in which its
            numbers are wanted: places in the packet's own order. None: as they are.

    Raises:
        ValueError: they are not of one type.
    """

    def __init__(self, layout: np.dtype[Any], **members: NDArray[np.int64] | None) -> None:
        parts, kinds = list[NDArray[np.int64]](), set[np.dtype[Any]]()
        for path, order in members.items():
            places, kind = _places(layout, path.split("__"))
            kinds.add(kind)
            places = places if order is None else places[order]
            parts.append((places[:, None] + np.arange(kind.itemsize)).ravel())
        if len(kinds) != 1:
            raise ValueError(f"{', '.join(members)}: of several types")
        self._kind = kinds.pop()
        self._places = np.concatenate(parts)
        ends = np.cumsum([0, *(len(part) // self._kind.itemsize for part in parts)]).tolist()
        self._cuts = [slice(*ends_of) for ends_of in pairwise(ends)]

    def read(self, raw: Raw, kind: type[Any]) -> list[NDArray[Any]]:
        """The numbers of each member, as another type.

        Args:
            raw: the packet's bytes.
            kind: of the numbers that are given.
        """
        numbers = raw[self._places].view(self._kind).astype(kind)
        return [numbers[cut] for cut in self._cuts]

    def write(self, raw: Raw, values: Sequence[NDArray[Any]]) -> None:
        """Put numbers of each member into a packet; they must fit."""
        numbers = np.concatenate(values).astype(self._kind)
        raw[self._places] = numbers.view(np.uint8)


def _places(layout: np.dtype[Any], path: Sequence[str]) -> tuple[NDArray[np.int64], np.dtype[Any]]:
    """Where the numbers of a member begin in a packet, and their type."""
    begins, kind = np.zeros(1, dtype=np.int64), layout
    for name in path:
        if kind.fields is None:
            raise ValueError(f"{name}: not a struct")
        kind, offset = kind.fields[name][:2]
        begins = begins + offset
        if kind.subdtype is not None:
            kind, shape = kind.subdtype
            within = kind.itemsize * np.arange(int(np.prod(shape)))
            begins = (begins[:, None] + within).ravel()
    return begins, kind
