"""Which instants of a run are shown, and the files that hold their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from quadriga.recordings.truth import Ticks

SHEET: Final = "walk.png"
CLIP: Final = "walk.webp"
FRAME: Final = (640, 360)  # pixels
SHEET_FRAMES: Final = 8
SHEET_COLUMNS: Final = 2
CLIP_MS: Final = 5000  # of world time, shown as long
PERIOD_MS: Final = 80  # between frames of the clip
_INK: Final = (25, 25, 30)
_GAP: Final = 6  # pixels between frames of the sheet


def sheet_ticks(ticks: Ticks) -> Ticks:
    """Instants of the contact sheet: evenly over the run, the last one included, ms."""
    count = min(SHEET_FRAMES, len(ticks))
    chosen: Ticks = ticks[np.linspace(0, len(ticks) - 1, count).round().astype(int)]
    return chosen


def clip_ticks(ticks: Ticks) -> Ticks:
    """Instants of the clip: the last `CLIP_MS` of the run, `PERIOD_MS` apart, ms."""
    wanted = np.arange(max(ticks[0], ticks[-1] - CLIP_MS), ticks[-1] + 1, PERIOD_MS)
    return np.unique(ticks[np.searchsorted(ticks, wanted)])


def save_sheet(folder: Path, ticks: Ticks, pictures: Sequence[Image.Image]) -> None:
    """Write the contact sheet `walk.png`, each picture with its world time."""
    (width, height), columns = pictures[0].size, SHEET_COLUMNS
    rows = -(-len(pictures) // columns)
    size = (columns * (width + _GAP) - _GAP, rows * (height + _GAP) - _GAP)
    sheet = Image.new("RGB", size, "white")
    for i, picture in enumerate(_stamp(ticks, pictures)):
        row, column = divmod(i, columns)
        sheet.paste(picture, (column * (width + _GAP), row * (height + _GAP)))
    sheet.save(folder / SHEET)


def save_clip(folder: Path, ticks: Ticks, pictures: Sequence[Image.Image]) -> None:
    """Write the clip `walk.webp`, as fast as the world was."""
    first, *others = _stamp(ticks, pictures)
    durations = [*np.diff(ticks).tolist(), PERIOD_MS]
    first.save(
        folder / CLIP,
        save_all=True,
        append_images=others,
        duration=durations,
        loop=0,
        quality=75,
        method=2,
    )


def _stamp(ticks: Ticks, pictures: Sequence[Image.Image]) -> list[Image.Image]:
    font = ImageFont.load_default(size=20)
    stamped = []
    for tick, picture in zip(ticks.tolist(), pictures, strict=True):
        copy = picture.convert("RGB")
        ImageDraw.Draw(copy).text((12, 8), f"{tick / 1000:.2f} s", fill=_INK, font=font)
        stamped.append(copy)
    return stamped
