"""SHELL of the file of where the simulated robots truly were."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import numpy as np

from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.wire.messages import Truth

PERIOD_MS: Final = 10
COLUMNS: Final = ("x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "wz")
_FLUSH: Final = 100  # rows


class TruthLog:
    """A CSV file: every `PERIOD_MS` the tick in ms, then of each robot `COLUMNS`.

    Position of the trunk's origin in m, its angles (yaw, then pitch, then roll) in rad, velocity in
    m/s, all in the world's frame, and its rate about the vertical in rad/s. Rows are turned into
    text at once and written each second, so that no tick has much to do.

    Args:
        path: of the file, which is written anew.
        names: of the robots.

    Raises:
        ConfigError: it cannot be written.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path = path
        with name_file_errors(ConfigError, path, "a file that can be written"):
            self._file = path.open("w", encoding="utf-8")
        header = ["ms", *(f"{name}_{column}" for name in names for column in COLUMNS)]
        self._rows = [",".join(header)]

    def note(self, truth: Truth) -> None:
        """Add a tick."""
        cells = [f"{number:.5f}" for number in truth_row(truth).tolist()]
        self._rows.append(",".join([str(truth.tick), *cells]))
        if len(self._rows) >= _FLUSH:
            self._write()

    def _write(self) -> None:
        self._file.write("\n".join([*self._rows, ""]))
        self._file.flush()
        self._rows.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Write the rest, however it ends."""
        with name_file_errors(ConfigError, self._path, "a disk with room"):
            self._write()
            self._file.close()


def truth_row(truth: Truth) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The numbers of `COLUMNS` of all robots, one robot after the other, (9 n,)."""
    w, x, y, z = truth.base_quat_wxyz.T
    angles = np.stack(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ],
        axis=1,
    )
    parts = [truth.base_pos, angles, truth.base_vel[:, :2], truth.base_omega[:, 2:]]
    row: np.ndarray[tuple[int], np.dtype[np.float64]] = np.hstack(parts).ravel()
    return row
