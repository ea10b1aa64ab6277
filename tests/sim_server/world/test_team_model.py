from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import FOOT_FRAMES, JOINT_NAMES, N_JOINTS
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.registry import ROBOTS
from quadriga.sim_server.terrain.terrain import TERRAIN_CONTACT
from quadriga.sim_server.world.layout import CONTACT_FORCES, FOOT_FORCES, NQ
from quadriga.sim_server.world.team_model import build_team_model, formation, spawn_positions
from tests.sim_server.standing import IDEAL_MOTORS, configured

GRAPHS = ("complete", "chain", "ring")


@pytest.mark.parametrize("kind", ROBOTS)
@pytest.mark.parametrize("rotors", [False, True])
def test_equals_pinocchio_in_mass_matrix_bias_and_foot_jacobians(kind: str, rotors: bool) -> None:
    random = np.random.default_rng(0)
    # The Go1's URDF has a link of 1 mg above its trunk, which the world leaves out.
    atol, bias_atol = (2e-6, 6e-5) if kind == "go1" else (1e-9, 1e-9)
    config = configured(motors=replace(IDEAL_MOTORS, rotor_inertia=rotors))
    team = build_team_model(replace(config, team=replace(config.team, robot=kind)))
    m, d = team.model, mujoco.MjData(team.model)
    model = build_pinocchio_model(ROBOTS[kind], rotors=rotors)
    quat = random.standard_normal(4)
    quat /= np.linalg.norm(quat)
    joints = random.uniform(-1.5, 1.5, N_JOINTS)
    position = random.standard_normal(3)
    v_pin = random.standard_normal(18) * 3.0
    rotation = pin.Quaternion(*quat).toRotationMatrix()
    # v_mujoco = T v_pin: Pinocchio has the trunk's linear velocity in the trunk's frame.
    T = np.eye(18)
    T[:3, :3] = rotation
    T_dot_v = np.zeros(18)
    T_dot_v[:3] = rotation @ np.cross(v_pin[3:6], v_pin[:3])

    d.qpos[:] = np.concatenate([position, quat, joints])
    d.qvel[:] = T @ v_pin
    mujoco.mj_forward(m, d)
    M = np.zeros((18, 18))
    mujoco.mj_fullM(m, d, M)
    q_pin = np.concatenate([position, quat[[1, 2, 3, 0]], joints])
    data = model.createData()

    M_pin = pin.crba(model, data, q_pin)
    M_pin = np.triu(M_pin) + np.triu(M_pin, 1).T
    np.testing.assert_allclose(T.T @ M @ T, M_pin, atol=atol)
    bias = T.T @ (M @ T_dot_v + d.qfrc_bias)
    expected = pin.nonLinearEffects(model, data, q_pin, v_pin)
    np.testing.assert_allclose(bias, expected, atol=bias_atol)
    pin.computeJointJacobians(model, data, q_pin)
    pin.updateFramePlacements(model, data)
    for foot in FOOT_FRAMES:
        J = np.zeros((3, 18))
        mujoco.mj_jacBody(m, d, J, None, m.body(f"r1/{foot}").id)
        frame = model.getFrameId(foot)
        J_pin = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
        np.testing.assert_allclose(J @ T, J_pin, atol=1e-9)
        np.testing.assert_allclose(
            d.body(f"r1/{foot}").xpos, data.oMf[frame].translation, atol=1e-9
        )


def test_every_robot_has_pinocchios_joint_order_and_the_agreed_mass() -> None:
    model = build_team_model(configured(3)).model
    assert tuple(build_pinocchio_model(A1).names)[2:] == JOINT_NAMES
    for robot in ("r1", "r2", "r3"):
        first = model.joint(f"{robot}/{JOINT_NAMES[0]}").id
        names = [model.joint(first + k).name for k in range(N_JOINTS)]
        assert names == [f"{robot}/{name}" for name in JOINT_NAMES]
        assert model.body(f"{robot}/trunk").mass == 4.713
        assert model.body(f"{robot}/trunk").subtreemass == pytest.approx(A1.mass)


@pytest.mark.parametrize("graph", GRAPHS)
def test_yokes_are_as_long_as_the_distance_of_the_spawned_trunks(graph: str) -> None:
    team = build_team_model(configured(5, yokes=graph))
    places = team.q_spawn.reshape(5, NQ)[:, :2]
    gaps = [np.linalg.norm(places[i] - places[j]) for i, j in team.yokes]
    np.testing.assert_allclose(team.rest_length, gaps)
    assert team.model.ntendon == team.model.neq == len(gaps)


def test_robots_are_scattered_around_their_places_by_the_seed() -> None:
    np.testing.assert_allclose(formation(3, 0.9), [[0.0, 0.45], [0.0, -0.45], [-0.9, 0.0]])
    assert not formation(1, 0.9).any()
    places = np.array([spawn_positions(configured(3, scatter=0.05, seed=s)) for s in range(40)])
    off = places - formation(3, 0.9)
    assert np.abs(off).max() <= 0.05
    assert off.std(axis=0).min() > 0.02
    np.testing.assert_array_equal(spawn_positions(configured(3, seed=5)), formation(3, 0.9))
    team = build_team_model(configured(3, scatter=0.05, seed=7))
    np.testing.assert_allclose(team.q_spawn.reshape(3, NQ)[:, :2], places[7])
    assert len(set(team.rest_length.round(6))) == 3


@pytest.mark.parametrize("leg_collisions", [False, True])
def test_robots_touch_each_other_if_their_legs_collide(leg_collisions: bool) -> None:
    team = build_team_model(configured(2, leg_collisions=leg_collisions))
    d = mujoco.MjData(team.model)
    d.qpos[:] = team.q_spawn
    d.qpos.reshape(2, NQ)[:, :3] = [0.0, 0.0, 0.15]  # both robots in one place, feet in the ground
    d.qpos.reshape(2, NQ)[:, 7:] = 0.0
    mujoco.mj_forward(team.model, d)
    ground = team.model.geom("ground").id
    assert d.ncon >= 8
    assert all(ground in pair for pair in d.contact.geom) != leg_collisions


@pytest.mark.parametrize("kind", ROBOTS)
def test_links_that_hang_on_each_other_do_not_touch(kind: str) -> None:
    """Within the joints' limits only links farther apart meet: a calf and a trunk, or two legs."""
    config = configured()
    team = build_team_model(replace(config, team=replace(config.team, robot=kind)))
    model, d, robot = team.model, mujoco.MjData(team.model), ROBOTS[kind]
    d.qpos[:] = team.q_spawn
    d.qpos[2] = 2.0
    mujoco.mj_forward(model, d)
    assert d.ncon == 0, "nothing touches while it stands"
    random, seen = np.random.default_rng(3), 0
    for _ in range(300):
        d.qpos[7:] = random.uniform(robot.lower, robot.upper)
        mujoco.mj_forward(model, d)
        for pair in d.contact.geom:
            seen += 1
            welded = [int(model.body_weldid[model.geom_bodyid[geom]]) for geom in pair]
            parents = [int(model.body_weldid[model.body_parentid[body]]) for body in welded]
            assert welded[0] != welded[1]
            grandparents = [int(model.body_weldid[model.body_parentid[body]]) for body in parents]
            assert welded[0] not in (parents[1], grandparents[1])
            assert welded[1] not in (parents[0], grandparents[0])
    assert seen > 0, "some of these poses fold legs into each other"


def test_a_shank_on_a_block_is_felt_by_the_robot_but_by_no_foot() -> None:
    """The sensors of feet and the truth's forces are those of feet alone."""

    def put_block(spec: mujoco.MjSpec) -> None:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[0.02, 0.2, 0.05],
            pos=[0.09, 0.13, 1.1],  # under the front left calf of a robot in the air
            **TERRAIN_CONTACT,
        )

    team = build_team_model(configured(), dress=put_block)
    d = mujoco.MjData(team.model)
    d.qpos[:] = team.q_spawn
    calf = team.model.body("r1/FL_calf").id
    for height in np.arange(1.5, 1.2, -0.002):
        d.qpos[2] = height
        mujoco.mj_forward(team.model, d)
        if d.ncon:
            break
    bodies = {int(team.model.geom_bodyid[geom]) for pair in d.contact.geom for geom in pair}
    assert bodies == {0, calf}
    assert np.abs(d.qfrc_constraint).max() > 1.0
    assert not d.sensordata[FOOT_FORCES].any()
    assert not d.sensordata[CONTACT_FORCES].any()
