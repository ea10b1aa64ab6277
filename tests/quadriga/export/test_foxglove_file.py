"""The exported MCAP as other people's readers see it."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from quadriga.commands.parser import main
from quadriga.export import team_scene
from quadriga.pictures.meshes import link_meshes
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import WorldConfig
from quadriga.shared.errors import MeshError, MessageError
from quadriga.shared.messages import Measurement, Plan, Reference, State, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.colours import robot_rgb
from quadriga.shared.robots.conventions import FOOT_FRAMES, Array
from quadriga.sim_server.world.team_model import build_team_model
from tests.a1 import build_pinocchio_model
from tests.quadriga.conftest import ESTIMATOR_ERROR, WriteRun, outputs, run_config
from tests.quadriga.conftest import truth as truth_message
from tests.quadriga.export.conftest import PLAN

Topics = dict[str, list[tuple[int, Any]]]  # log time, ns, and decoded message


def read(path: Path) -> Topics:
    found: Topics = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


@pytest.fixture(scope="module")
def exported(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("foxglove") / "run.mcap"
    assert main(["export", str(file), "--to", "foxglove", "-o", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def topics(exported: Path) -> Topics:
    return read(exported)


@pytest.fixture(scope="module")
def truths(file: Path) -> list[Truth]:
    return list(Recording(file).messages(Truth))


def array(vector: Any, names: Sequence[str] = "xyz") -> Array:
    return np.array([getattr(vector, name) for name in names])


def rotation(quaternion: Any) -> Array:
    x, y, z, w = array(quaternion, "xyzw").tolist()
    matrix: Array = pin.Quaternion(w, x, y, z).toRotationMatrix()
    return matrix


def test_every_message_is_there_at_its_world_time(file: Path, topics: Topics) -> None:
    counts = Counter(entry.key for entry in Recording(file).entries())
    counts["team/r1/state"] -= 1
    del counts["team/some/body/else"]
    named = {f"team{topic}": len(found) for topic, found in topics.items() if "team" not in topic}
    assert counts.items() <= named.items()
    for found in topics.values():
        assert all(not hasattr(m, "tick") or m.tick * 10**6 == time for time, m in found)


def test_numbers_have_names_and_are_the_recorded_ones(file: Path, topics: Topics) -> None:
    recording = Recording(file)
    state = list(recording.messages(State, "r2"))[70]
    found = topics["/r2/state"][70][1]
    assert found.q_joint.RL_calf == state.q_joint[8]
    assert state.foot_force[3] == found.foot_force.RR
    truth = list(recording.messages(Truth))[40]
    found = topics["/sim/truth"][40][1]
    assert (found.r2.grf.FR.z, found.r1_r2.yoke_error) == (truth.grf[1, 1, 2], truth.yoke_error[0])
    plan = topics["/r1/plan"][-1][1]
    assert [sample.u.RR.z for sample in plan.samples] == PLAN.u[:, 11].tolist()
    assert (plan.status, plan.used.r2) == ("nominal:no data", 11.0)
    status = topics["/r1/status"][-1][1]
    assert (status.ages_ms.plan_r2, list(status.planner_ms)) == (350.0, [0.5, 0.25])
    assert topics["/reference"][-1][1].height == next(recording.messages(Reference)).height


def test_tracking_stands_side_by_side(file: Path, topics: Topics) -> None:
    recording, names = Recording(file), ("z", "vx", "vy", "roll", "pitch", "wz")
    ticks = [m.tick for m in recording.messages(Measurement, "r2")]
    assert [m.tick for _, m in topics["/r2/tracking"]] == ticks
    row = topics["/r2/tracking"][60][1]
    np.testing.assert_allclose(array(row.true, names), outputs(600, 1), atol=1e-9)
    np.testing.assert_allclose(array(row.estimated, names), outputs(600, 1) + ESTIMATOR_ERROR)
    plans = {m.tick: m for m in recording.messages(Plan, "r2")}
    np.testing.assert_array_equal(array(row.planned, names), plans[560].y[3])
    assert row.reference.vx == pytest.approx(0.5 * 0.3)
    early = topics["/r2/tracking"][10][1]
    assert np.isnan(array(early.planned, names)).all(), "no plan was made yet"


def test_frames_are_where_the_robots_own_kinematics_has_them(
    file: Path, topics: Topics, truths: list[Truth]
) -> None:
    frames = topics["/frames"]
    assert [time for time, _ in frames] == [10**6 * m.tick for m in truths]
    at = {f.child_frame_id: f for f in frames[47][1].transforms}
    model = build_pinocchio_model()
    physics, truth = model.createData(), truths[47]
    for i, name in enumerate(("r1", "r2")):
        state = next(m for m in valid_states(file, name) if m.tick == truth.tick)
        w, x, y, z = truth.base_quat_wxyz[i]
        q = np.concatenate([truth.base_pos[i], [x, y, z, w], state.q_joint])
        pin.framesForwardKinematics(model, physics, q)
        for link in (*FOOT_FRAMES, "trunk", "RL_thigh"):
            pose, found = physics.oMf[model.getFrameId(link)], at[f"{name}/{link}"]
            np.testing.assert_allclose(array(found.translation), pose.translation, atol=1e-9)
            np.testing.assert_allclose(rotation(found.rotation), pose.rotation, atol=1e-9)
            assert found.parent_frame_id == "world"


def test_bodies_are_drawn_once_on_their_frames(topics: Topics) -> None:
    (first,) = [m for _, m in topics["/scene/robots"]]
    frames = {f.child_frame_id for f in topics["/frames"][0][1].transforms}
    assert {e.frame_id for e in first.entities} <= frames
    assert all(entity.frame_locked for entity in first.entities)
    meshes = link_meshes(A1.urdf_path())
    links = {f"{robot}/{link}" for robot in ("r1", "r2") for link in meshes}
    assert {entity.id for entity in first.entities} == links
    for entity in first.entities:
        drawn = entity.triangles
        assert not [*entity.cubes, *entity.spheres, *entity.cylinders]
        known = meshes[entity.id.partition("/")[2]]
        assert [len(one.points) for one in drawn] == [len(mesh.vertices) for mesh in known]
        assert [len(one.indices) for one in drawn] == [mesh.faces.size for mesh in known]
        corner = array(drawn[0].points[-1])
        np.testing.assert_allclose(corner, known[0].vertices[-1])


def test_trunks_have_their_robots_colour_and_name(topics: Topics) -> None:
    ((_, first),) = topics["/scene/robots"]
    trunks = {e.id.partition("/")[0]: e for e in first.entities if e.id.endswith("/trunk")}
    for index, robot in enumerate(("r1", "r2")):
        hull, (tag,) = trunks[robot].triangles[0], trunks[robot].texts
        assert (tag.text, tag.billboard) == (robot, True)
        for colour in (hull.color, tag.color):
            np.testing.assert_allclose(array(colour, "rgba"), [*robot_rgb(index), 1.0])


def test_without_meshes_links_are_boxes_balls_and_cylinders(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def find_none(_urdf: Path) -> None:
        raise MeshError("mesh trunk.dae", "no such file", "a file")

    monkeypatch.setattr(team_scene, "link_meshes", find_none)
    out = tmp_path / "out.mcap"
    assert main(["export", str(file), "--to", "foxglove", "-o", str(out)]) == 0
    ((_, first),) = read(out)["/scene/robots"]
    shapes = Counter(
        kind
        for e in first.entities
        for kind in ("cubes", "spheres", "cylinders")
        for _ in getattr(e, kind)
    )
    assert shapes == {"cubes": 2, "spheres": 8, "cylinders": 2 * 4 * 3}
    assert all(min(array(c.size)) > 0.01 for e in first.entities for c in e.cylinders)


def test_arrows_stand_on_the_feet_along_the_forces(topics: Topics, truths: list[Truth]) -> None:
    for at in (3, 47):
        frames = {f.child_frame_id: f.translation for f in topics["/frames"][at][1].transforms}
        feet = [array(frames[f"{name}/{foot}"]) for name in ("r1", "r2") for foot in FOOT_FRAMES]
        update = topics["/scene/forces"][at][1]
        by_id = {entity.id: entity for entity in update.entities}
        loaded = [
            (foot, force)
            for foot, force in zip(feet, truths[at].grf.reshape(-1, 3), strict=True)
            if np.linalg.norm(force) > 1.0
        ]
        assert len(by_id["forces"].arrows) == len(loaded) in (4, 8)
        for arrow, (foot, force) in zip(by_id["forces"].arrows, loaded, strict=True):
            np.testing.assert_allclose(array(arrow.pose.position), foot, atol=1e-9)
            along = rotation(arrow.pose.orientation)[:, 0]
            length = arrow.shaft_length + arrow.head_length
            np.testing.assert_allclose(along * length, 0.002 * force, atol=1e-9)
        colours = {tuple(array(arrow.color, "rgb")) for arrow in by_id["forces"].arrows}
        assert colours == {robot_rgb(0), robot_rgb(1)}
        (rod,) = by_id["yokes"].lines
        first, last = (array(point) for point in rod.points)
        assert np.linalg.norm(first - last) == pytest.approx(0.9, abs=0.01)


def test_planned_forces_are_arrows_turned_into_the_world(topics: Topics) -> None:
    assert not {e.id: e for e in topics["/scene/forces"][3][1].entities}["planned"].arrows
    update = topics["/scene/forces"][76][1]
    arrows = {entity.id: entity for entity in update.entities}["planned"].arrows
    turn = pin.utils.rotate("z", 0.3)
    of_r1 = PLAN.u[0].reshape(4, 3) @ turn.T
    lengths = [arrow.shaft_length + arrow.head_length for arrow in arrows[:4]]
    np.testing.assert_allclose(lengths, 0.002 * np.linalg.norm(of_r1, axis=1))
    for arrow, force in zip(arrows[:4], of_r1, strict=True):
        along = rotation(arrow.pose.orientation)[:, 0]
        np.testing.assert_allclose(along, force / np.linalg.norm(force), atol=1e-9)


def test_events_are_log_lines(topics: Topics) -> None:
    time, fall = topics["/events"][-1]
    assert (time, fall.name, fall.message) == (700_000_000, "r2", "fall: tilt 1.10 rad")
    assert fall.level == 3


@pytest.mark.parametrize("terrain", ["boxes", "heightfield"])
def test_terrain_lies_at_its_height(write_run: WriteRun, tmp_path: Path, terrain: str) -> None:
    world = WorldConfig(duration=0.5, seed=7, terrain=terrain)
    config = replace(run_config(2, 0.5), world=world)
    folder = write_run(config)
    out = tmp_path / "out.mcap"
    assert main(["export", str(folder / "run.mcap"), "--to", "foxglove", "-o", str(out)]) == 0
    ((_, update),) = read(out)["/scene/terrain"]
    (surface,) = update.entities[0].triangles
    points = np.array([array(point) for point in surface.points])
    height = build_team_model(config).terrain.height(points[:, 0], points[:, 1])
    np.testing.assert_allclose(points[:, 2], height, atol=1e-9)
    assert points[:, 2].max() > 0.01
    corners = points[np.array(surface.indices)].reshape(-1, 3, 3)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert area.min() > 0.0, "all seen from above"
    assert area.sum() == pytest.approx(np.prod(np.ptp(points[:, :2], axis=0)))


def test_loose_stones_are_no_part_of_the_scene(write_run: WriteRun, tmp_path: Path) -> None:
    world = WorldConfig(duration=0.5, terrain="pebbles", terrain_height=0.02)
    folder = write_run(replace(run_config(2, 0.5), world=world))
    out = tmp_path / "out.mcap"
    assert main(["export", str(folder / "run.mcap"), "--to", "foxglove", "-o", str(out)]) == 0
    found = read(out)
    links = {frame.child_frame_id for frame in found["/frames"][0][1].transforms}
    assert {"r1/trunk", "r2/trunk"} <= links
    assert all(link.startswith(("r1/", "r2/")) for link in links)
    (drawn,) = [update for _, update in found["/scene/robots"]]
    assert {entity.id for entity in drawn.entities} <= links


def test_a_recording_of_real_robots_has_no_scene(write_run: WriteRun, tmp_path: Path) -> None:
    lose: Callable[..., Any] = lambda key, m: None if key == "team/sim/truth" else m  # noqa: E731
    folder, out = write_run(run_config(1, 0.5), change=lose), tmp_path / "out.mcap"
    assert main(["export", str(folder / "run.mcap"), "--to", "foxglove", "-o", str(out)]) == 0
    found = read(out)
    assert len(found["/r1/tracking"]) == 50
    assert np.isnan(found["/r1/tracking"][0][1].true.z)
    assert not [topic for topic in found if topic.startswith(("/scene", "/frames"))]


def test_forged_truths_are_left_out(
    write_run: WriteRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config, out = run_config(2, 0.5), tmp_path / "out.mcap"
    four = truth_message(run_config(4, 0.5), 200, 0.0)
    folder = write_run(config, extra=[("team/sim/truth", four), ("other/sim/truth", four)])
    assert main(["export", str(folder / "run.mcap"), "--to", "foxglove", "-o", str(out)]) == 0
    assert "left out 1 messages of team/sim/truth" in capsys.readouterr().out
    assert len(read(out)["/frames"]) == 51


def test_a_plan_of_nothing_is_left_out(
    write_run: WriteRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nothing = Plan(320, 0, 8, np.zeros((0, 12)), np.zeros((0, 6)), "solved", {}, 0)
    folder, out = write_run(run_config(1, 0.5), extra=[("team/r1/plan", nothing)]), tmp_path / "o"
    assert main(["export", str(folder / "run.mcap"), "--to", "foxglove", "-o", str(out)]) == 0
    assert "left out 1 messages of team/r1/plan" in capsys.readouterr().out


def test_rerun_finds_nothing_wrong_and_shows_named_columns(
    exported: Path, file: Path, tmp_path: Path
) -> None:
    chunk = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed")
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "mcap", "check", str(exported)],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
        env={"HOME": str(tmp_path)},  # in its first session it reports to nobody
    )
    assert done.returncode == 0, done.stdout + done.stderr
    parts = [
        part.to_record_batch().to_pydict()["quadriga.State:message"]
        for part in chunk.McapReader(str(exported)).stream()
        if part.entity_path == "/r1/state" and "message_log_time" in part.timeline_names
    ]
    shown = [row["q_joint"]["FL_thigh"] for part in parts for (row,) in part]
    assert shown == [m.q_joint[1] for m in valid_states(file, "r1")]


def valid_states(file: Path, robot: str) -> list[State]:
    states = []
    for entry in Recording(file).entries({"state"}):
        if entry.key == f"team/{robot}/state":
            try:
                states.append(decode(entry.payload, State))
            except MessageError:
                continue
    return states
