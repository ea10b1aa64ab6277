"""Robots in meshes are the same robots: nothing but their looks is different."""

from __future__ import annotations

from functools import partial

import mujoco
import numpy as np

from quadriga.pictures.meshes import link_meshes
from quadriga.pictures.robot_shapes import dress
from quadriga.shared.robots.a1 import A1
from quadriga.sim_server.world.team_model import build_team_model
from tests.quadriga.conftest import run_config

CONFIG = run_config(2, 0.5)
DRAWN = mujoco.MjvOption().geomgroup


def dressed() -> mujoco.MjModel:
    meshes = link_meshes(A1.urdf_path())
    return build_team_model(CONFIG, partial(dress, robots=("r1", "r2"), meshes=meshes)).model


def test_a_dressed_team_moves_as_the_bare_one() -> None:
    finals = []
    for model in (build_team_model(CONFIG).model, dressed()):
        data = mujoco.MjData(model)
        data.qpos[:] = build_team_model(CONFIG).q_spawn
        mujoco.mj_step(model, data, 200)
        assert data.ncon, "it touches the ground"
        finals.append((data.qpos.copy(), data.sensordata.copy(), data.ncon))
    np.testing.assert_array_equal(finals[0][0], finals[1][0])
    np.testing.assert_array_equal(finals[0][1], finals[1][1])
    assert finals[0][2] == finals[1][2]


def test_only_meshes_of_the_robots_are_seen_and_trunks_have_their_colours() -> None:
    model = dressed()
    bare = build_team_model(CONFIG).model
    for robot in ("r1", "r2"):
        bodies = [i for i in range(model.nbody) if model.body(i).name.startswith(f"{robot}/")]
        seen = [
            geom
            for geom in range(model.ngeom)
            if model.geom_bodyid[geom] in bodies and DRAWN[model.geom_group[geom]]
        ]
        assert {int(model.geom_type[geom]) for geom in seen} == {int(mujoco.mjtGeom.mjGEOM_MESH)}
        assert len({int(model.geom_bodyid[geom]) for geom in seen}) == 13
        colours = [model.geom_rgba[geom].tolist() for geom in seen]
        assert bare.geom(f"{robot}/trunk").rgba.tolist() in colours


def test_without_meshes_robots_are_boxes_and_capsules() -> None:
    plain = build_team_model(CONFIG, partial(dress, robots=("r1", "r2"), meshes={})).model
    bare = build_team_model(CONFIG).model
    assert plain.ngeom == bare.ngeom
    np.testing.assert_array_equal(plain.geom_group, bare.geom_group)
