from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from quadriga.plant.commands import MOTOR_DAMPING
from quadriga.shared.codec import decode, encode
from quadriga.shared.messages import Event, Truth
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import GRAVITY, N_JOINTS, Array
from quadriga.sim_server.world.world import World
from tests.a1 import TORQUE_LIMIT, TOTAL_MASS, q_stand
from tests.sim_server.standing import STAND, command, configured, momentum, shift, stand


@pytest.mark.parametrize("n", [1, 5])
def test_standing_team_stays_up_and_the_ground_carries_its_weight(n: int) -> None:
    world = World(configured(n, payload=10.0))
    stand(world, 800)
    truth = world.truth()
    assert world.fallen() == ()
    weight = (n * TOTAL_MASS + 10.0) * GRAVITY
    assert truth.grf[:, :, 2].sum() == pytest.approx(weight, rel=5e-3)
    assert np.abs(truth.yoke_error).max(initial=0.0) < 1e-4
    assert truth.yoke_error.shape == truth.yoke_force.shape == (n * (n - 1) // 2,)


def test_yoke_force_is_negative_when_the_yoke_pulls() -> None:
    world = World(configured(2, push="r1:30:90:0:1,r2:30:-90:0:1"))  # apart, along the yoke
    stand(world, 700)
    assert world.truth().yoke_force[0] < -10.0
    assert 0.0 < world.truth().yoke_error[0] < 1e-3


def test_equal_configurations_and_commands_give_equal_bytes() -> None:
    config = configured(
        3, noise=True, terrain="boxes", push="r1:60:90:0.1:0.1", payload=4.5, seed=3
    )
    first, second = World(config), World(config)
    assert first.states()["r1"].row.tobytes() == first.states()["r1"].row.tobytes()
    for tick in range(300):
        commands = {"r1": STAND, "r2": STAND} if tick % 2 else {"r2": STAND, "r1": STAND}
        assert first.step(commands) == second.step(commands)
        for name in first.names:
            assert encode(first.states()[name]) == encode(second.states()[name])
    assert encode(first.truth()) == encode(second.truth())
    assert tuple(decode(encode(first.truth()), Truth).robots) == first.names
    other = World(replace(config, world=replace(config.world, seed=4)))
    assert encode(other.states()["r1"]) != encode(World(config).states()["r1"])


def test_a_push_changes_the_momentum_by_its_impulse() -> None:
    world = World(configured(2, push="r2:80:90:0.01:0.05"))
    shift(world, dz=10.0)  # in the air nothing else acts sideways
    events: list[Event] = []
    for _ in range(100):
        events += world.step({})
    np.testing.assert_allclose(momentum(world)[:2], [0.0, 80.0 * 0.05], atol=0.02)
    assert momentum(world)[2] == pytest.approx(-2 * TOTAL_MASS * GRAVITY * 0.1, rel=1e-3)
    assert [(e.tick, e.robot) for e in events if e.kind == "push"] == [(10, "r2")]
    assert not world.physics.xfrc_applied.any()


def test_published_forces_are_those_that_led_to_the_published_velocity() -> None:
    world = World(configured(1))
    stand(world, 20)  # the feet still settle, so forces change from tick to tick
    for _ in range(50):
        before = momentum(world)
        world.step({"r1": STAND})
        force = world.truth().grf[0].sum(axis=0) - [0.0, 0.0, TOTAL_MASS * GRAVITY]
        np.testing.assert_allclose(momentum(world) - before, 1e-3 * force, atol=2e-4)


def test_sensors_belong_to_the_tick_they_are_published_for() -> None:
    world = World(configured(2))
    for _ in range(60):
        v_before = world.physics.qvel.reshape(2, 18)[:, :6].copy()
        world.step({"r1": STAND})
        truth = world.truth()
        for i, state in enumerate(world.states().values()):
            q, v = world.physics.qpos.reshape(2, 19)[i], world.physics.qvel.reshape(2, 18)[i]
            np.testing.assert_array_equal(state.q_joint, q[7:])
            np.testing.assert_array_equal(state.v_joint, v[6:])
            np.testing.assert_allclose(state.imu_gyro, v[3:6], atol=1e-12)
            np.testing.assert_allclose(state.imu_quat_wxyz, q[3:7], atol=1e-12)
            # On the plane the contact normal is the vertical.
            np.testing.assert_allclose(state.foot_force, truth.grf[i, :, 2], atol=1e-9)
            rotation = world.physics.body(f"r{i + 1}/trunk").xmat.reshape(3, 3)
            np.testing.assert_allclose(truth.base_omega[i], rotation @ v[3:6], atol=1e-12)
            specific = rotation @ state.imu_accel - [0.0, 0.0, GRAVITY]
            np.testing.assert_allclose(
                truth.base_vel[i] - v_before[i, :3], 1e-3 * specific, atol=2e-4
            )


def test_accelerometer_reads_gravity_at_rest_and_nothing_in_free_fall() -> None:
    world = World(configured(1))
    stand(world, 1000)
    np.testing.assert_allclose(world.states()["r1"].imu_accel, [0, 0, GRAVITY], atol=0.1)
    assert world.states()["r1"].foot_force.sum() == pytest.approx(TOTAL_MASS * GRAVITY, rel=1e-3)
    shift(world, dz=5.0)
    stand(world, 300)
    np.testing.assert_allclose(world.states()["r1"].imu_accel, 0.0, atol=0.05)
    assert not world.states()["r1"].foot_force.any()


def test_motor_law_is_followed_and_limited() -> None:
    world = World(configured(1))
    stand(world, 10)
    random = np.random.default_rng(0)
    low = np.array([[-40.0], [-2.0], [-3.0], [0.0], [0.0]])
    high = np.array([[40.0], [2.0], [3.0], [20.0], [2.0]])
    tau, q_des, v_des, kp, kd = random.uniform(low, high, (5, N_JOINTS))
    before = world.states()["r1"]
    world.step({"r1": command(tau=tau, q_des=q_des, v_des=v_des, kp=kp, kd=kd)})
    wanted = tau + kp * (q_des - before.q_joint) + kd * (v_des - before.v_joint)
    assert (np.abs(wanted) > TORQUE_LIMIT).any()
    expected = np.clip(wanted, -TORQUE_LIMIT, TORQUE_LIMIT)
    np.testing.assert_allclose(world.states()["r1"].tau_joint, expected, atol=1e-12)
    np.testing.assert_allclose(world.physics.qfrc_applied[6:], expected, atol=1e-12)


def test_a_weak_motor_gives_its_share_of_the_torque_from_its_time_on() -> None:
    config = configured(2, motor_strength="r2:RL_calf:0.01:0.4")
    world, sound = World(config), World(configured(2))
    asked = command(tau=np.linspace(-40.0, 40.0, N_JOINTS))
    for tick in range(12):
        events = world.step({"r1": asked, "r2": asked})
        sound.step({"r1": asked, "r2": asked})
        tau = {name: state.tau_joint for name, state in world.states().items()}
        limited = np.clip(asked.tau, -TORQUE_LIMIT, TORQUE_LIMIT)
        np.testing.assert_array_equal(tau["r1"], limited)
        limited[8] *= 0.4 if tick >= 10 else 1.0
        np.testing.assert_array_equal(tau["r2"], limited)
        faults = [(e.code, e.robot, e.detail) for e in events if e.kind == "fault"]
        expected = [("weak-motor", "r2", "RL_calf gives 40 % of its torque")] if tick == 10 else []
        assert faults == expected
        assert (encode(world.truth()) == encode(sound.truth())) == (tick < 10)


def test_a_robot_without_a_command_is_damped_and_the_others_go_on() -> None:
    world = World(configured(2))
    stand(world, 50)
    for _ in range(50):
        before = world.states()
        world.step({"r1": STAND, "r9": STAND})
        np.testing.assert_allclose(
            world.states()["r2"].tau_joint, -MOTOR_DAMPING * before["r2"].v_joint, atol=1e-12
        )
        pd = 200.0 * (q_stand() - before["r1"].q_joint) - 4.0 * before["r1"].v_joint
        np.testing.assert_allclose(world.states()["r1"].tau_joint, pd, atol=1e-9)


def test_a_fall_is_announced_once_per_robot() -> None:
    world = World(configured(2, yokes="chain"))
    events: list[Event] = []
    for _ in range(1500):
        events += world.step({})
    falls = [event for event in events if event.kind == "fall"]
    assert sorted(event.robot for event in falls) == ["r1", "r2"] == list(world.fallen())
    assert all(0 < event.tick <= 1500 for event in falls)
    assert [event.kind for event in events[:2]] == ["start", "terrain"]


def test_trunk_height_counts_from_the_terrain_under_the_hips() -> None:
    world = World(configured(1, terrain="heightfield", terrain_height=0.3, duration=8.0))
    x = np.linspace(2.0, 5.0, 3000)
    under = world.team.terrain.height_under_hips(
        x, np.zeros_like(x), np.zeros_like(x), A1.feet_under_hips
    )
    world.physics.qpos[0] = x[under.argmax()]
    for above, fallen in ((0.125, ()), (0.115, ("r1",))):
        world.physics.qpos[2] = under.max() + above
        world.physics.qpos[7:] = np.tile([0.0, 2.6, -2.6], 4)  # feet folded away from the ground
        mujoco.mj_forward(world.team.model, world.physics)
        world.physics.qvel[:] = 0.0
        world.step({})
        assert world.fallen() == fallen


def test_who_stands_astride_of_a_block_has_not_fallen() -> None:
    """The block is under the trunk and nobody touches it; the feet stand on the ground."""
    world = World(configured(1, terrain="boxes", terrain_height=0.15, duration=8.0))
    terrain = world.team.terrain
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(1.5, 5, 0.02), np.arange(-1, 1, 0.02)))
    astride = terrain.height(x, y) - terrain.height_under_hips(
        x, y, np.zeros_like(x), A1.feet_under_hips
    )
    place = astride.argmax()
    assert astride[place] > 0.145, "no such place"
    world.physics.qpos[:3] = x[place], y[place], 0.26
    world.physics.qpos[7:] = q_stand()
    mujoco.mj_forward(world.team.model, world.physics)
    world.step({"r1": STAND})
    assert world.fallen() == ()


@pytest.mark.parametrize("speed", [np.nan, 1e12])
def test_an_unstable_world_is_named_and_does_not_start_again(
    speed: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    world = World(configured(1))
    stand(world, 100)
    world.physics.qvel[0] = speed
    mujoco.mj_forward(world.team.model, world.physics)
    events = [*world.step({"r1": STAND}), *world.step({"r1": STAND})]
    assert [(event.code, event.robot) for event in events] == [("unstable", "")]
    assert world.fallen() == ("r1",)
    assert not np.abs(world.truth().base_pos[0, 0]) < 1e6
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("terrain", ["flat", "boxes", "heightfield"])
def test_feet_have_the_configured_friction_and_one_robot_alone_another(terrain: str) -> None:
    ground = {"terrain": terrain, "terrain_height": 0.04, "duration": 8.0}
    world = World(configured(3, friction=0.35, friction_of="r2:0.3", **ground))  # type: ignore[arg-type]
    shift(world, dx=3.0, dz=0.03)
    stand(world, 300)
    model, contact = world.team.model, world.physics.contact
    roots = model.body_rootid[model.geom_bodyid[contact.geom]].max(axis=1)
    slippery = roots == world.team.trunks[1]
    assert 0 < slippery.sum() < len(slippery)
    np.testing.assert_allclose(contact.friction[:, 0], np.where(slippery, 0.3, 0.35))
    np.testing.assert_allclose(contact.solref, [[0.01, 1.0]] * world.physics.ncon)


def test_when_a_tick_is_settled_changes_nothing() -> None:
    early, late = World(configured(2)), World(configured(2))
    for _ in range(60):
        early.settle()
        early.settle()
        for world in (early, late):
            world.step({"r1": STAND, "r2": STAND})
    assert early.physics.qpos.tobytes() == late.physics.qpos.tobytes()
    assert encode(early.truth()) == encode(late.truth())
    assert encode(early.states()["r2"]) == encode(late.states()["r2"])


PUSHES = "r1:60:90:0.01:0.05,r2:60:0:0.02:0.05"


def test_a_robot_in_a_world_of_its_own_fares_as_beside_the_others() -> None:
    """It has its place, noise, pushes and events, and none of the others' events."""
    keys = {"scatter": 0.1, "payload": 2.0, "payload_on": "r2:1"}
    config = configured(3, yokes="none", noise=True, push=PUSHES, **keys)  # type: ignore[arg-type]
    together = World(config)
    calm = World(replace(config, world=replace(config.world, push="")))
    alone = {name: World(config, (name,)) for name in together.names}
    for name, world in alone.items():
        assert world.names == (name,)
        np.testing.assert_array_equal(own(world, name), own(together, name))
        np.testing.assert_allclose(world.states()[name].row, together.states()[name].row, atol=1e-9)
    stand(together, 100)
    stand(calm, 100)
    told = dict[str, list[tuple[str, str]]]()
    for name, world in alone.items():
        events = [event for _ in range(100) for event in world.step({name: STAND})]
        told[name] = [(event.kind, event.robot) for event in events]
        np.testing.assert_allclose(own(world, name), own(together, name), atol=1e-4)
        pushed = np.abs(own(world, name) - own(calm, name)).max() > 1e-3
        assert pushed == (name in PUSHES)
    assert told["r1"] == [("start", ""), ("terrain", ""), ("push", "r1")]
    assert told["r2"] == [("start", ""), ("terrain", ""), ("payload", "r2"), ("push", "r2")]
    assert told["r3"] == [("start", ""), ("terrain", "")]


def own(world: World, robot: str) -> Array:
    truth = world.truth()
    place: Array = truth.base_pos[truth.robots.index(robot)]
    return place


def test_yokes_are_those_between_the_robots_that_are_there() -> None:
    chain = configured(3, yokes="chain")
    assert World(chain, ("r2", "r3")).team.yokes == ((0, 1),)
    assert World(chain, ("r1", "r3")).team.yokes == ()
