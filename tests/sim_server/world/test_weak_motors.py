import numpy as np
import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import JOINT_NAMES
from quadriga.sim_server.world.weak_motors import WeakMotor, weak_motors
from tests.sim_server.standing import configured


def weak(text: str, seed: int = 0) -> tuple[WeakMotor, ...]:
    return weak_motors(configured(3, weak_motor=text), np.random.default_rng(seed))


def test_motors_are_named_by_robot_and_joint() -> None:
    first, second = weak("r2:RL_thigh:1.5, r3:FL_hip:0")
    assert (first.robot, JOINT_NAMES[first.joint], first.start) == (1, "RL_thigh_joint", 1500)
    assert (second.robot, JOINT_NAMES[second.joint], second.start) == (2, "FL_hip_joint", 0)
    assert first.share == 0.6
    assert weak("") == ()


@pytest.mark.parametrize(
    ("joint", "among"),
    [
        ("calf", {"FL_calf_joint", "FR_calf_joint", "RL_calf_joint", "RR_calf_joint"}),
        ("RR", {"RR_hip_joint", "RR_thigh_joint", "RR_calf_joint"}),
        ("any", set(JOINT_NAMES)),
    ],
)
def test_what_is_left_open_is_drawn_from_the_seed(joint: str, among: set[str]) -> None:
    found = [weak(f"any:{joint}:2", seed)[0] for seed in range(100)]
    assert {JOINT_NAMES[motor.joint] for motor in found} == among
    assert {motor.robot for motor in found} == {0, 1, 2}
    assert weak(f"any:{joint}:2", 7) == weak(f"any:{joint}:2", 7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r1:calf", "robot:joint:start"),
        ("r4:calf:0", "robot 'r4'"),
        ("r1:knee:0", "joint 'knee'"),
        ("r1:calf:soon", "start 'soon'"),
        ("r1:calf:-1", "start '-1'"),
        ("r1:calf:nan", "start 'nan'"),
        ("r1:calf:0,", "robot:joint:start"),
    ],
)
def test_a_wrong_motor_names_the_key_and_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.weak_motor: .*{message}"):
        weak(text)
