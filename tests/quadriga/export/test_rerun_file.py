"""The exported recording as Rerun's own reader sees it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from quadriga.commands.parser import main
from quadriga.pictures.meshes import link_meshes
from quadriga.shared.messages import Plan, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.colours import robot_colour
from quadriga.shared.robots.conventions import OUTPUTS, Array
from tests.quadriga.conftest import ESTIMATOR_ERROR, WriteRun, outputs, run_config
from tests.quadriga.export.conftest import PLAN

Rows = dict[str, list[Any]]


class Exported:
    """A file for Rerun, read back."""

    def __init__(self, path: Path) -> None:
        reader = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed").RrdReader
        self.path, self._file = path, reader(path)
        (self.recording,) = self._file.recordings()
        (self.blueprint,) = self._file.blueprints()
        self.entities = self._read(self.recording)

    def views(self) -> dict[str, Rows]:
        return self._read(self.blueprint)

    def _read(self, store: Any) -> dict[str, Rows]:
        """Columns of each entity, all chunks one after the other."""
        found: dict[str, Rows] = {}
        for chunk in self._file.stream(store=store):
            rows = found.setdefault(str(chunk.entity_path), {})
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                if ":" in name or name in ("tick", "world_time"):
                    rows.setdefault(name, []).extend(batch.column(name).to_pylist())
        return found

    def array(self, path: str, column: str) -> Array:
        return np.array(self.entities[path][column], dtype=float)

    def scalars(self, path: str) -> dict[int, float]:
        """Values by tick."""
        rows = self.entities[path]
        return {t: v for t, (v,) in zip(rows["tick"], rows["Scalars:scalars"], strict=False)}


def export(path: Path, out: Path) -> Exported:
    assert main(["export", str(path), "--to", "rerun", "-o", str(out)]) == 0
    return Exported(out)


@pytest.fixture(scope="module")
def exported(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    return export(file, tmp_path_factory.mktemp("rerun") / "run.rrd")


@pytest.fixture(scope="module")
def truths(file: Path) -> list[Truth]:
    return list(Recording(file).messages(Truth))


def rgba(colour: str) -> int:
    """A colour as Rerun packs it."""
    return int(colour.removeprefix("#") + "ff", 16)


def test_rerun_finds_nothing_wrong(exported: Exported, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(exported.path)],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
        env={"HOME": str(tmp_path)},  # in its first session it reports to nobody
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_trunks_are_where_they_were_at_their_world_time(
    exported: Exported, truths: list[Truth]
) -> None:
    for i, robot in enumerate(("r1", "r2")):
        rows = exported.entities[f"/world/{robot}/trunk"]
        assert rows["tick"] == [truth.tick for truth in truths]
        assert [t.total_seconds() for t in rows["world_time"]] == pytest.approx(
            [truth.tick / 1000 for truth in truths]
        )
        places = np.array(rows["Transform3D:translation"], dtype=float)[:, 0]
        np.testing.assert_allclose(places, [t.base_pos[i] for t in truths], atol=1e-6)
        turns = np.array(rows["Transform3D:quaternion"], dtype=float)[:, 0]
        known = np.array([np.roll(t.base_quat_wxyz[i], -1) for t in truths])
        np.testing.assert_allclose(turns, known, atol=1e-6)


def test_robots_are_meshes_in_their_colours_with_their_names(exported: Exported) -> None:
    meshes = link_meshes(A1.urdf_path())
    for i, robot in enumerate(("r1", "r2")):
        for link, known in meshes.items():
            for k, mesh in enumerate(known):
                rows = exported.entities[f"/world/{robot}/{link}/{k}"]
                (corners,) = rows["Mesh3D:vertex_positions"]
                np.testing.assert_allclose(corners, mesh.vertices)
                (faces,) = rows["Mesh3D:triangle_indices"]
                np.testing.assert_array_equal(faces, mesh.faces)
        hull = exported.entities[f"/world/{robot}/trunk/0"]
        assert hull["Mesh3D:albedo_factor"] == [[rgba(robot_colour(i))]]
        name = exported.entities[f"/world/{robot}/trunk/name"]
        assert name["Points3D:labels"] == [[robot]]
        assert name["Points3D:colors"] == [[rgba(robot_colour(i))]]


def test_normals_look_outwards(exported: Exported) -> None:
    hull = exported.entities["/world/r1/trunk/0"]
    corners, normals = (
        np.array(hull[f"Mesh3D:vertex_{name}"][0]) for name in ("positions", "normals")
    )
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-3)
    top = corners[:, 2] > np.quantile(corners[:, 2], 0.98)
    assert normals[top, 2].mean() > 0.5


def test_forces_stand_on_the_feet(exported: Exported, truths: list[Truth]) -> None:
    true = exported.entities["/world/r2/forces/true"]
    at = true["tick"].index(470)
    forces = truths[47].grf[1]
    loaded = forces[np.linalg.norm(forces, axis=1) > 1.0]
    np.testing.assert_allclose(true["Arrows3D:vectors"][at], 0.002 * loaded, atol=1e-6)
    assert len(true["Arrows3D:origins"][at]) == len(loaded) in (2, 4)
    planned = exported.entities["/world/r1/forces/planned"]
    turn = pin.utils.rotate("z", 0.3)
    np.testing.assert_allclose(
        planned["Arrows3D:vectors"][planned["tick"].index(760)],
        0.002 * PLAN.u[0].reshape(4, 3) @ turn.T,
        atol=1e-6,
    )
    assert planned["Arrows3D:vectors"][planned["tick"].index(30)] == []


def test_yokes_and_paths_are_lines(exported: Exported, truths: list[Truth], file: Path) -> None:
    ((rod,), *_) = exported.entities["/world/yokes"]["LineStrips3D:strips"]
    assert np.linalg.norm(np.subtract(*rod)) == pytest.approx(0.9, abs=0.01)
    ((walked,),) = exported.entities["/world/r1/path/walked"]["LineStrips3D:strips"]
    down = [0.0, 0.0, A1.stand_height]
    np.testing.assert_allclose(walked, [t.base_pos[0] - down for t in truths], atol=1e-6)
    planned = exported.entities["/world/r1/path/planned"]
    plans = list(Recording(file).messages(Plan, "r1"))
    assert planned["tick"] == [plan.tick for plan in plans]
    (first,) = planned["LineStrips3D:strips"][0]
    np.testing.assert_allclose(first[0], truths[40].base_pos[0], atol=1e-6)
    assert len(first) == 26


def test_curves_stand_side_by_side_in_units_that_people_read(
    exported: Exported, file: Path
) -> None:
    for k, output in enumerate(OUTPUTS):
        factor = np.rad2deg(1.0) if output in ("roll", "pitch", "wz") else 1.0
        path = f"/r2/{output}"
        true, own = (exported.scalars(f"{path}/{name}")[600] for name in ("true", "estimated"))
        assert true == pytest.approx(factor * outputs(600, 1)[k], abs=1e-9)
        assert own == pytest.approx(factor * (outputs(600, 1) + ESTIMATOR_ERROR)[k])
        plan = next(m for m in Recording(file).messages(Plan, "r2") if m.tick == 560)
        assert exported.scalars(f"{path}/planned")[600] == pytest.approx(factor * plan.y[3, k])
    assert exported.scalars("/r1/vx/asked")[600] == pytest.approx(0.15)
    assert exported.scalars("/r1/force/RR/planned")[760] == PLAN.u[0, 11]
    line = exported.entities["/r2/z/true"]
    assert line["SeriesLines:colors"][-1] == [rgba(robot_colour(1))]
    assert line["SeriesLines:names"][-1] == ["r2 true"]


def test_events_modes_times_and_ages_are_there(exported: Exported) -> None:
    events = exported.entities["/events"]
    assert (events["tick"][-1], events["TextLog:text"][-1]) == (700, ["r2 fall: tilt 1.10 rad"])
    assert events["TextLog:level"][-1] == ["WARN"]
    modes = exported.entities["/r1/mode"]
    assert list(zip(modes["tick"], modes["StateChange:state"], strict=True)) == [
        (0, ["stand"]),
        (300, ["walk"]),
        (750, ["stopping: peer-lost:r2"]),
    ]
    assert exported.scalars("/r1/times/planner_ms")[750] == 0.5
    assert exported.scalars("/r1/times/tick_us")[100] == 60.0
    assert exported.scalars("/r1/ages/plan.r2") == {750: 350.0}


def test_every_view_shows_something(exported: Exported) -> None:
    views = [rows for path, rows in exported.views().items() if path.startswith("/view/")]
    origins = [
        rows["ViewBlueprint:space_origin"][0][0]
        for rows in views
        if "ViewBlueprint:space_origin" in rows
    ]
    asked = [
        line for rows in views for query in rows.get("ViewContents:query", []) for line in query
    ]
    assert len(origins) > 15
    assert "/world" in origins
    for path in (*origins, *(line for line in asked if line.startswith("/"))):
        there = [
            name for name in exported.entities if f"{name}/".startswith(f"{path.rstrip('/')}/")
        ]
        assert there, path


def test_a_recording_of_real_robots_has_curves_and_no_scene(
    write_run: WriteRun, tmp_path: Path
) -> None:
    lose: Callable[..., Any] = lambda key, m: None if key == "team/sim/truth" else m  # noqa: E731
    found = export(write_run(run_config(1, 0.5), change=lose) / "run.mcap", tmp_path / "out.rrd")
    assert not [path for path in found.entities if path.startswith("/world")]
    assert not [path for path in found.entities if path.endswith("/true")]
    assert len(found.scalars("/r1/z/estimated")) == 50
    assert found.scalars("/r1/vx/asked")[490] > 0.0


def test_what_is_left_out_is_said(file: Path, tmp_path: Path, capsys: Any) -> None:
    export(file, tmp_path / "out.rrd")
    said = capsys.readouterr().out
    assert "left out 1 messages of team/r1/state" in said
    assert "left out 1 messages of team/some/body/else" in said
