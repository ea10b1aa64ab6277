"""Loose stones near feet are bodies of the world; all others lie still and cost nothing.

Thousands of free bodies would take longer to simulate than the robots. So the world has a few and
lends one to every stone near a low foot, until the stone lies still and no foot is near.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import Array

_MARGIN: Final = 0.01  # m around foot and stone; a foot moves less until the next update
_LOW: Final = 0.03  # m from the top of the largest stone to a foot that counts as near
_LEAVE: Final = 0.02  # m beyond the distance at which it got its body, a stone may lose it
_STILL: Final = (0.02, 1.0)  # m/s, rad/s
_NOBODY: Final = -1


class LyingStones(Protocol):
    """Stones as they lie at first."""

    @property
    def pose(self) -> Array:
        """Centre and attitude wxyz of each stone, shape (s, 7), m, world."""

    @property
    def size(self) -> NDArray[np.int64]:
        """Index of each stone's size, shape (s,)."""

    @property
    def half(self) -> Array:
        """Half axes of the stones of each size, shape (sizes, 3), m."""


class LooseStones:
    """The assignment of bodies to stones, and the poses of all other stones.

    Attributes:
        pose: of every stone, as of when it last lay still, shape (s, 7), m, world.
        stone_of: the stone that each body is lent to, −1 for none, shape (p,).
        without: how often no body was left for a stone near a foot. That foot then passes through
            the stone, because a stone that appears inside a foot would throw it away.
    """

    def __init__(
        self, stones: LyingStones, parked: Array, model: Any, physics: Any, foot_radius: float
    ) -> None:
        """Take over the last bodies of a world.

        Args:
            stones: as they lie at first.
            parked: poses of the bodies while they are not in use, shape (p, 7), m, world; as many
                of each size, ordered by size.
            model: the compiled world.
            physics: its state.
            foot_radius: radius of the robots' feet, m.
        """
        self._parked, count = parked, len(parked)
        self._q = physics.qpos[-7 * count :].reshape(count, 7)
        self._v = physics.qvel[-6 * count :].reshape(count, 6)
        self._warm = physics.qacc_warmstart[-6 * count :].reshape(count, 6)
        self._weightless = model.body_gravcomp[-count:]
        self._size, self._of_size = stones.size, np.arange(count) * len(stones.half) // count
        self._touching = foot_radius + float(stones.half.max())
        self._near = self._touching + _MARGIN
        self._on_top = 2.0 * float(stones.half[:, 2].max()) + foot_radius
        self.pose = stones.pose.copy()
        self.stone_of = np.full(count, _NOBODY)
        self.without = 0
        self._cells: defaultdict[tuple[int, int], set[int]] = defaultdict(set)
        for stone in range(len(self.pose)):
            self._cells[self._cell(self.pose[stone])].add(stone)

    def follow(self, feet: Array) -> None:
        """Lend bodies to stones near low feet, take them from stones that lie still.

        To be called between the integration of a tick and the evaluation of the next.

        Args:
            feet: centres of all feet, shape (f, 3), m, world.
        """
        low = feet[feet[:, 2] < self._on_top + _LOW]
        self._put_to_rest(low[:, :2])
        for stone in self._asleep_near(low):
            self._wake(stone)

    def _cell(self, place: Array) -> tuple[int, int]:
        return int(place[0] // self._near), int(place[1] // self._near)

    def _asleep_near(self, feet: Array) -> list[int]:
        """Stones without a body that a foot is near, but not inside, in order."""
        stones: set[int] = set()
        for x, y, z in feet.tolist():
            i, j = self._cell(np.array((x, y)))
            around = [
                s
                for a in (-1, 0, 1)
                for b in (-1, 0, 1)
                for s in self._cells.get((i + a, j + b), ())
            ]
            if around:
                places = self.pose[around, :2]
                square = (places[:, 0] - x) ** 2 + (places[:, 1] - y) ** 2
                close = square < self._near**2
                if z < self._on_top:
                    close &= square > self._touching**2
                stones.update(np.array(around)[close].tolist())
        return sorted(stones)

    def _wake(self, stone: int) -> None:
        free = np.flatnonzero((self._of_size == self._size[stone]) & (self.stone_of == _NOBODY))
        if not len(free):
            self.without += 1
            return
        body = int(free[0])
        self._cells[self._cell(self.pose[stone])].discard(stone)
        self._set(body, stone, self.pose[stone], weightless=0.0)

    def _put_to_rest(self, feet: Array) -> None:
        awake = np.flatnonzero(self.stone_of != _NOBODY)
        if not len(awake):
            return
        v = self._v[awake]
        still = np.linalg.norm(v[:, :3], axis=1) < _STILL[0]
        still &= np.linalg.norm(v[:, 3:], axis=1) < _STILL[1]
        if len(feet):
            away = self._q[awake, None, :2] - feet
            still &= np.linalg.norm(away, axis=-1).min(axis=1) > self._near + _LEAVE
        for body in awake[still].tolist():
            stone = int(self.stone_of[body])
            self.pose[stone] = self._q[body]
            self._cells[self._cell(self.pose[stone])].add(stone)
            self._set(body, _NOBODY, self._parked[body], weightless=1.0)

    def _set(self, body: int, stone: int, pose: Array, *, weightless: float) -> None:
        self.stone_of[body] = stone
        self._q[body], self._v[body], self._warm[body] = pose, 0.0, 0.0
        self._weightless[body] = weightless
