"""The gallery: every scenario with a small clip, on a page that is in step with the scenarios."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageSequence

from quadriga.experiments.gallery import FOLDER, PAGE, build_page, shrink_clip
from quadriga.team.scenarios import names


def test_the_committed_page_is_in_step_with_the_scenarios() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == build_page(FOLDER), "make docs"
    assert page.count("\n### ") == len(names())


def test_every_scenario_has_a_clip() -> None:
    assert {path.stem for path in FOLDER.glob("*.webp")} == set(names())


def test_a_clip_that_is_missing_leaves_the_rest_of_the_page(tmp_path: Path) -> None:
    page = build_page(tmp_path)
    assert "![" not in page
    assert "quadriga walk --scenario stairs --seed 7" in page


def test_a_clip_is_shrunk_to_its_last_moments(tmp_path: Path) -> None:
    source, target = tmp_path / "walk.webp", tmp_path / "small.webp"
    frames = []
    for k in range(70):
        frame = Image.new("RGB", (640, 360), "white")
        ImageDraw.Draw(frame).rectangle((0, 0, 8 * k, 360), fill="black")
        frames.append(frame)
    first, *others = frames
    first.save(source, save_all=True, append_images=others, duration=80, quality=90)
    shrink_clip(source, target)
    with Image.open(target) as clip:
        small = [frame.convert("L") for frame in ImageSequence.Iterator(clip)]
        assert clip.size == (384, 216)
        assert clip.info["loop"] == 0
    dark = [int((np.asarray(frame) < 128).sum()) for frame in small]
    assert dark == sorted(dark), "in the order of time"
    assert dark[-1] == max(dark)
    assert 20 <= len(small) <= 28
    assert target.stat().st_size < source.stat().st_size
