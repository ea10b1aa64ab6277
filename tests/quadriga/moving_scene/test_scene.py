"""What a page draws is what was recorded: packed and unpacked, and in a real browser."""

from __future__ import annotations

import json
from base64 import b64decode
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.moving_scene.page_scene import scene_of
from quadriga.moving_scene.scene import STEP_MS, build_scene
from quadriga.moving_scene.spans import Span
from quadriga.pictures.meshes import link_meshes
from quadriga.report.page import build_page
from quadriga.report.run import read_run
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import Array
from quadriga.view.compose import compose
from quadriga.view.mesh_groups import group_meshes
from quadriga.view.recorded import RecordedRun
from tests.browser import CHROMIUM, WHY_NOT, browser
from tests.quadriga.conftest import WriteRun, run_config

SPAN = Span(700, 900, "</script><b>")


def unpack(text: str, kind: str, *shape: int) -> Array:
    values: Array = np.frombuffer(b64decode(text), dtype=kind).reshape(shape).astype(float)
    return values


def scene(run: RecordedRun, span: Span = SPAN) -> dict[str, Any]:
    meshes = link_meshes(run.shape.config.robot.urdf_path())
    found: dict[str, Any] = json.loads(build_scene(run, [span], meshes))
    return found


def test_poses_forces_and_contacts_are_those_of_the_recording(known_run: Path) -> None:
    run = RecordedRun(Recording(known_run / "run.mcap"))
    told = scene(run)
    (span,) = told["spans"]
    n, count, links = run.shape.count, span["pictures"], span["links"]
    assert count == (SPAN.last - SPAN.first) // STEP_MS + 1
    unit, origin = span["unit"], np.array(span["origin"])
    positions = unit * unpack(span["positions"], "<i2", count, n, links, 3) + origin
    quats = unpack(span["quats"], "<i2", count, n, links, 4) / 32767.0
    feet = unit * unpack(span["feet"], "<i2", count, n, 4, 3) + origin
    anchors = unit * unpack(span["anchors"], "<i2", count, n, 3) + origin
    forces = 0.1 * unpack(span["forces"], "<i2", count, n, 4, 3)
    contact = unpack(span["contact"], "u1", count, n, 4)
    groups = group_meshes(link_meshes(run.shape.config.robot.urdf_path()), run.shape.skeleton.links)
    drawn = sorted({link for group in groups for link in group.links})
    assert len(drawn) == links
    for k in range(count):
        picture = compose(run.shape, run.snapshot(SPAN.first + k * STEP_MS))
        assert positions[k] == pytest.approx(picture.link_positions[:, drawn], abs=unit)
        assert quats[k] == pytest.approx(picture.link_quats[:, drawn], abs=1e-4)
        assert feet[k] == pytest.approx(picture.feet, abs=unit)
        assert anchors[k] == pytest.approx(picture.anchors, abs=unit)
        assert forces[k] == pytest.approx(picture.true_forces, abs=0.051)
        assert (contact[k] > 0.0).tolist() == picture.contact.tolist()
    assert unit < 1e-3, "m"
    assert span["isTruth"]
    assert [robot["name"] for robot in told["robots"]] == list(run.shape.robots)
    for mesh, group in zip(told["meshes"], groups, strict=True):
        vertices = mesh["unit"] * unpack(mesh["vertices"], "<i2", -1, 3)
        assert vertices == pytest.approx(np.asarray(group.mesh.vertices), abs=mesh["unit"])
        assert unpack(mesh["faces"], "<u2", -1, 3).tolist() == group.mesh.faces.tolist()
        assert [drawn[link] for link in mesh["links"]] == list(group.links)


@pytest.mark.parametrize("terrain", ["boxes", "heightfield"])
def test_the_ground_is_drawn_near_the_team_alone(write_run: WriteRun, terrain: str) -> None:
    config = run_config(2, 1.0)
    config = replace(config, world=replace(config.world, terrain=terrain))
    run = RecordedRun(Recording(write_run(config) / "run.mcap"))
    told = scene(run)
    if terrain == "boxes":
        rows = unpack(told["boxes"], "<f4", -1, 10)
        assert len(rows) == len(unpack(told["boxColours"], "u1", -1, 3)) > 0
        places = rows[:, :2]
    else:
        places = unpack(told["surface"]["vertices"], "<f4", -1, 3)[:, :2]
        faces = unpack(told["surface"]["faces"], "<u4", -1)
        assert 0 <= faces.min() < faces.max() < len(places)
    trunks = run.snapshot(SPAN.first).truth.base_pos[:, :2]  # type: ignore[union-attr]
    assert np.abs(places - trunks.mean(axis=0)).max() < 4.0


@pytest.mark.nightly
def test_a_page_shows_it_in_a_browser(known_run: Path, tmp_path: Path) -> None:
    run = read_run(known_run / "run.mcap")
    text = scene_of(run).replace('"4 strides"', json.dumps(SPAN.title))
    page = build_page(run, b"", text)
    assert page.count(SPAN.title) == 0, "nothing in a scene ends its element"
    assert len(text) < 400_000
    if CHROMIUM is None:
        pytest.skip(WHY_NOT)
    file = tmp_path / "report.html"
    file.write_text(page, encoding="utf-8")
    with browser(tmp_path / "profile") as chromium, chromium.open(file.as_uri()) as shown:
        shown.await_true("document.querySelector('.scene .told').innerText.includes(' s')")
        first = shown.evaluate("document.querySelector('.scene .told').innerText")
        shown.evaluate("document.querySelector('.scene').scrollIntoView()")
        shown.screenshot(tmp_path / "scene.png")
        shown.evaluate("document.querySelector('.scene button').click()")
        shown.await_true(f"document.querySelector('.scene .told').innerText !== {first!r}")
        assert not shown.complaints
