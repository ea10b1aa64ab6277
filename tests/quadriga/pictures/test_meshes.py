"""Links look like the meshes of their URDF: where they belong, coarse, and made once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from quadriga.pictures.decimation import read_surfaces
from quadriga.pictures.link_mesh import LinkMesh, LinkMeshes
from quadriga.pictures.meshes import link_meshes
from quadriga.pictures.urdf_visuals import mesh_visuals
from quadriga.shared.errors import MeshError
from quadriga.shared.robots.conventions import Array, Leg
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.runtime.places import cache_files

PARTS = ("hip", "thigh", "calf")


def urdf_of(robot: str) -> Path:
    return ROBOTS[robot].urdf_path()


@pytest.fixture
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


@cache
def meshes_of(robot: str) -> LinkMeshes:
    return link_meshes(urdf_of(robot))


def box(meshes: tuple[LinkMesh, ...]) -> Array:
    """Lowest and highest coordinates of a link's meshes, shape (2, 3), m, link frame."""
    vertices = np.concatenate([mesh.vertices for mesh in meshes]).astype(float)
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def centroid(meshes: tuple[LinkMesh, ...]) -> Array:
    """Middle of a link's surfaces, shape (3,), m, link frame."""
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes]).astype(float)
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    middle: Array = np.average(corners.mean(axis=1), axis=0, weights=area)
    return middle


@pytest.mark.parametrize("robot", ROBOTS)
def test_trunk_and_every_link_of_the_legs_have_a_mesh(robot: str) -> None:
    meshes = meshes_of(robot)
    legs = {f"{leg.name}_{part}" for leg in Leg for part in PARTS}
    assert set(meshes) == {ROBOTS[robot].trunk_link, *legs}
    for mesh in (mesh for several in meshes.values() for mesh in several):
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)
        assert np.isfinite(mesh.vertices).all()
        assert len(mesh.rgba) == 4
        assert max(mesh.rgba) <= 1.0


@pytest.mark.parametrize("robot", ROBOTS)
def test_trunks_lie_along_x_and_are_as_large_as_the_robots(robot: str) -> None:
    low, high = box(meshes_of(robot)[ROBOTS[robot].trunk_link])
    length, width, height = high - low
    assert 0.38 < length < 0.48  # with the head, m
    assert 0.19 < width < 0.21
    assert 0.11 < height < 0.20
    assert abs(low[1] + high[1]) < 0.005


@pytest.mark.parametrize("robot", ROBOTS)
def test_links_touch_at_their_joints_and_calves_end_in_the_feet(robot: str) -> None:
    """At zero angles all frames are parallel, so that boxes are compared as they are."""
    meshes, model = meshes_of(robot), pin.buildModelFromUrdf(str(urdf_of(robot)))
    for leg in Leg:
        above = box(meshes[ROBOTS[robot].trunk_link])
        for part in PARTS:
            link = f"{leg.name}_{part}"
            joint = model.jointPlacements[model.getJointId(f"{link}_joint")].translation
            low, high = box(meshes[link]) + joint
            gaps = np.maximum(low - above[1], above[0] - high)
            assert gaps.max() < 0.003, link
            above = box(meshes[link])
        foot = model.frames[model.getFrameId(f"{leg.name}_foot")].placement.translation
        vertices = np.concatenate([mesh.vertices for mesh in meshes[f"{leg.name}_calf"]])
        radius = foot[2] - vertices[:, 2].min()
        assert 0.018 < radius < 0.026, leg
        sole = vertices[vertices[:, 2] < foot[2]].astype(float)
        np.testing.assert_allclose(sole.mean(axis=0)[:2], foot[:2], atol=0.01)


@pytest.mark.parametrize("robot", ROBOTS)
def test_left_legs_mirror_right_ones_and_rear_hips_front_ones(robot: str) -> None:
    meshes = meshes_of(robot)
    across, along = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, 1.0])
    pairs = [(f"{end}L_{part}", f"{end}R_{part}", across) for end in "FR" for part in PARTS]
    pairs += [(f"F{side}_hip", f"R{side}_hip", along) for side in "LR"]
    for one, other, mirror in pairs:
        turned = np.sort(box(meshes[other]) * mirror, axis=0)
        np.testing.assert_allclose(box(meshes[one]), turned, atol=0.006, err_msg=one)
        middle = centroid(meshes[other]) * mirror
        np.testing.assert_allclose(centroid(meshes[one]), middle, atol=0.01, err_msg=one)


@pytest.mark.parametrize("robot", ROBOTS)
def test_meshes_have_few_triangles_and_the_extent_of_their_sources(robot: str) -> None:
    meshes = meshes_of(robot)
    triangles = sum(len(mesh.faces) for several in meshes.values() for mesh in several)
    assert 4000 < triangles < 11_000
    if robot == "go1":
        return  # 28 MB of text
    for link, several in mesh_visuals(urdf_of(robot)).items():
        sources = [
            surface.copy().apply_transform(visual.transform).bounds
            for visual in several
            for surface, _ in read_surfaces(visual.path)
        ]
        extent = [np.min(sources, axis=(0, 1)), np.max(sources, axis=(0, 1))]
        np.testing.assert_allclose(box(meshes[link]), extent, atol=0.006, err_msg=link)


def test_the_second_time_no_mesh_file_is_taken_apart(own_cache: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from quadriga.pictures.meshes import link_meshes\n"
        "meshes = link_meshes(Path(sys.argv[1]))\n"
        "print(len(meshes), 'trimesh' in sys.modules)"
    )
    for said in ("13 True", "13 False"):
        done = subprocess.run(
            [sys.executable, "-c", code, str(urdf_of("go2"))],
            env=os.environ | {"XDG_CACHE_HOME": str(own_cache)},
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.strip() == said
    assert len(cache_files("meshes")) == 1


@pytest.mark.parametrize("damage", ["cut", "altered", "foreign"])
def test_a_damaged_file_of_the_cache_is_made_anew(own_cache: Path, damage: str) -> None:
    first = link_meshes(urdf_of("go2"))
    (path,) = cache_files("meshes")
    whole = path.read_bytes()
    if damage == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "altered":
        path.write_bytes(whole[:5000] + bytes(100) + whole[5100:])
    else:
        arrays: dict[str, Any] = {"base.0.vertices": np.zeros((3, 3))}
        with path.open("wb") as file:
            np.savez(file, **arrays)
    second = link_meshes(urdf_of("go2"))
    assert path.read_bytes() == whole
    assert list(second) == list(first)
    for link, several in first.items():
        for one, other in zip(several, second[link], strict=True):
            np.testing.assert_array_equal(one.vertices, other.vertices)
            np.testing.assert_array_equal(one.faces, other.faces)
            assert one.rgba == other.rgba


def test_another_source_file_gives_other_meshes(own_cache: Path, tmp_path: Path) -> None:
    urdf = copied(tmp_path)
    link_meshes(urdf_of("go2"))
    link_meshes(urdf)
    assert len(cache_files("meshes")) == 1, "the same files, wherever they are"
    foot = urdf.parents[1] / "visuals" / "foot.dae"
    foot.write_text(foot.read_text().replace("1 0 0 2.5e-4", "1 0 0 0.1"))
    moved = link_meshes(urdf)
    assert len(cache_files("meshes")) == 2
    assert box(moved["FL_calf"])[1, 0] > 0.1


def test_meshes_are_made_where_no_cache_can_be_written(own_cache: Path) -> None:
    (own_cache / "quadriga").write_text("a file where the folder should be")
    assert len(link_meshes(urdf_of("go2"))) == 13


@pytest.mark.parametrize(
    ("content", "match"), [(None, "no such file"), ("<COLLADA>", "foot.dae"), ("", "foot.dae")]
)
@pytest.mark.usefixtures("own_cache")
def test_a_mesh_that_is_missing_or_damaged_is_one_clear_error(
    tmp_path: Path, content: str | None, match: str
) -> None:
    urdf = copied(tmp_path)
    foot = urdf.parents[1] / "visuals" / "foot.dae"
    foot.unlink()
    if content is not None:
        foot.write_text(content)
    with pytest.raises(MeshError, match=match) as caught:
        link_meshes(urdf)
    assert "\n" not in str(caught.value)


def copied(folder: Path) -> Path:
    """The URDF of a copy of the Go2's description."""
    robots = folder / "example-robot-data" / "robots" / "go2_description"
    shutil.copytree(urdf_of("go2").parents[1], robots)
    return robots / "urdf" / "go2.urdf"


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
ARM = """<robot name="arm">
<material name="blue"><color rgba="0 0 1 1"/></material>
<link name="world"/>
<link name="arm"/>
<link name="plate"><visual>
  <origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/>
  <geometry><mesh filename="part.obj" scale="0.1 0.1 -0.1"/></geometry><material name="blue"/>
</visual></link>
<joint name="turn" type="revolute"><parent link="world"/><child link="arm"/></joint>
<joint name="bolts" type="fixed">
  <origin xyz="1 0 0" rpy="1.5707963267948966 0 0"/><parent link="arm"/><child link="plate"/>
</joint>
<transmission name="gear"><joint name="turn"/></transmission>
</robot>"""


@pytest.mark.usefixtures("own_cache")
def test_scale_mirror_rotation_and_fixed_links_are_as_the_urdf_says(tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text(TETRAHEDRON)
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(ARM)
    meshes = link_meshes(urdf)
    assert list(meshes) == ["arm"]
    (mesh,) = meshes["arm"]
    assert mesh.rgba == (0.0, 0.0, 1.0, 1.0)
    # Scaled, (x, y, z) → (−y, x, z + 0.5), then (x, −z, y) + (1, 0, 0).
    expected = [[1, -0.5, 0], [1, -0.5, 0.1], [0.8, -0.5, 0], [1, -0.2, 0]]
    found = mesh.vertices[np.lexsort(mesh.vertices.round(6).T)]
    wanted = np.array(expected)[np.lexsort(np.array(expected).T)]
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    volume = np.linalg.det(mesh.vertices[mesh.faces].astype(float) - [1, -0.5, 0]).sum() / 6
    assert volume == pytest.approx(0.1 * 0.2 * 0.3 / 6), "triangles face outwards, though mirrored"


@pytest.mark.usefixtures("own_cache")
def test_what_is_smaller_than_the_finest_detail_vanishes(tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text(TETRAHEDRON)
    trimesh.creation.icosphere(subdivisions=2, radius=4e-4).export(tmp_path / "bolt.stl")
    bolt = '<visual><geometry><mesh filename="bolt.stl"/></geometry></visual>'
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(ARM.replace("</visual>", "</visual>" + bolt))
    (mesh,) = link_meshes(urdf)["arm"]
    assert len(mesh.faces) == 4


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("<robot", "XML"),
        (ARM.replace('"0.1 0.1 -0.1"', '"0.1 0.1"'), "3 numbers"),
        (ARM.replace('"0 0 1 1"', '"0 0 blue 1"'), "4 numbers"),
        (ARM.replace('<child link="plate"/>', ""), "bolts"),
    ],
)
def test_a_urdf_that_cannot_be_read_is_one_clear_error(
    tmp_path: Path, text: str, match: str
) -> None:
    (tmp_path / "part.obj").write_text(TETRAHEDRON)
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(text)
    with pytest.raises(MeshError, match=match):
        link_meshes(urdf)
