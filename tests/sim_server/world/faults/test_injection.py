import numpy as np
import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.wire import codes
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import Event, State
from quadriga.sim_server.world.world import World
from tests.sim_server.standing import STAND, configured


def states_of(world: World, ticks: int) -> tuple[list[dict[str, State]], list[Event]]:
    states, events = [world.states()], list[Event]()
    for _ in range(ticks):
        events += world.step({name: STAND for name in world.names})
        states.append(world.states())
    return states, events


def test_a_faulty_sensor_lies_and_the_truth_does_not() -> None:
    config = configured(2, faults="r2/accel stuck 0.1 0.05", noise=True)
    faulty, events = states_of(World(config), 200)
    sound, _ = states_of(World(configured(2, noise=True)), 200)
    for tick in range(201):
        assert encode(faulty[tick]["r1"]) == encode(sound[tick]["r1"])
        if 100 <= tick < 150:
            np.testing.assert_array_equal(faulty[tick]["r2"].imu_accel, sound[99]["r2"].imu_accel)
            np.testing.assert_array_equal(faulty[tick]["r2"].imu_gyro, sound[tick]["r2"].imu_gyro)
        else:
            assert encode(faulty[tick]["r2"]) == encode(sound[tick]["r2"])
    told = [(e.tick, e.code, e.robot, e.detail) for e in events if e.kind == "fault"]
    assert told == [
        (100, codes.FAULT_BEGINS, "r2", "accel stuck"),
        (150, codes.FAULT_ENDS, "r2", "accel sound again"),
    ]


def test_a_motor_that_is_off_gives_no_torque_and_the_others_theirs() -> None:
    world = World(configured(1, faults="r1/motor_FL_calf off 0.1"))
    states_of(world, 150)
    torque = world.motors.torque[0]
    assert torque[2] == 0.0
    assert np.all(torque[[5, 8, 11]] > 3.0)  # the other knees carry the trunk


def test_a_robot_whose_motors_are_off_falls() -> None:
    world = World(configured(1, faults="r1/motors off 0.1"))
    states_of(world, 900)
    assert world.fallen() == ("r1",)


def test_equal_seeds_give_equal_garbage() -> None:
    config = configured(1, faults="r1/encoders garbage 0, r1/motor_RR intermittent 0.05")
    (first, _), (second, _) = (states_of(World(config), 120) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        assert encode(one["r1"]) == encode(other["r1"])


def test_a_robot_in_a_world_of_its_own_has_its_own_faults() -> None:
    config = configured(2, faults="r2/feet off 0, r1/gyro off 0")
    world = World(config, names=("r2",))
    states, events = states_of(world, 60)
    assert np.all(states[-1]["r2"].foot_force == 0.0)
    assert np.any(states[-1]["r2"].imu_gyro != 0.0)
    assert {event.robot for event in events if event.kind == "fault"} == {"r2"}


def test_a_fault_that_does_not_parse_is_a_wrong_configuration() -> None:
    with pytest.raises(ConfigError, match=r"^world\.faults"):
        World(configured(1, faults="r1/nose stuck 1"))


@pytest.mark.parametrize("kind", ["stuck", "garbage", "delayed", "off"])
def test_a_fault_that_is_asked_for_is_the_same_as_one_that_was_known_from_the_start(
    kind: str,
) -> None:
    config = configured(2, noise=True, live_faults=True)
    world, known = World(config), World(configured(2, noise=True, faults=f"r2/imu {kind} 0.1 0.05"))
    before, _ = states_of(world, 40)
    told = world.inject(f"r2/imu {kind} 0.05")
    assert [(e.tick, e.code, e.detail) for e in told] == [
        (40, codes.FAULT_ASKED, f"r2/imu {kind} 0.100 0.05")
    ]
    after, events = states_of(world, 160)
    expected, announced = states_of(known, 200)
    for one, other in zip([*before, *after[1:]], expected, strict=True):
        assert encode(one["r2"]) == encode(other["r2"])
    assert [e for e in events if e.kind == "fault"] == [e for e in announced if e.kind == "fault"]


def test_nobody_makes_a_world_faulty_that_does_not_permit_it() -> None:
    world = World(configured(1))
    with pytest.raises(ConfigError, match=r"world\.live_faults = true"):
        world.inject("r1/imu off")


@pytest.mark.parametrize("fault", ["r1/imu", "r1/imu off 1 2", "r9/imu off", "r1/imu of", "r1 imu"])
def test_a_fault_that_there_cannot_be_is_refused(fault: str) -> None:
    world = World(configured(1, live_faults=True))
    with pytest.raises(ConfigError):
        world.inject(fault)
