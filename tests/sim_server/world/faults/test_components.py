import numpy as np
import pytest

from quadriga.shared.robot.conventions import JOINT_NAMES, Array
from quadriga.shared.robot.robots import ROBOTS
from quadriga.shared.wire.messages import Command, State
from quadriga.sim_server.world.faults.components import build_components


@pytest.mark.parametrize("kind", ROBOTS)
def test_parts_of_a_component_are_disjoint_and_within_its_message(kind: str) -> None:
    for name, parts in build_components(ROBOTS[kind]).items():
        columns = np.concatenate([part.columns for part in parts])
        sizes = {State: State.CUTS["foot_force"].stop, Command: Command.CUTS["kd"].stop}
        (message,) = {part.message for part in parts}
        assert len(set(columns)) == len(columns), name
        assert columns.min() >= 0
        assert columns.max() < sizes[message]
        for part in parts:
            assert part.low.shape == part.high.shape == part.columns.shape
            assert np.all(part.low <= part.high)
            assert part.wrong(np.linspace(0.1, 0.9, len(part.columns))).shape == part.columns.shape


def test_every_joint_has_an_encoder_and_a_motor() -> None:
    components = build_components(ROBOTS["a1"])
    for joint, name in enumerate(JOINT_NAMES):
        short = name.removesuffix("_joint")
        (encoder,), (motor,) = components[f"encoder_{short}"], components[f"motor_{short}"]
        assert encoder.columns.tolist() == [
            State.CUTS["q_joint"].start + joint,
            State.CUTS["v_joint"].start + joint,
        ]
        assert set(motor.columns) == {cut.start + joint for cut in Command.CUTS.values()}


def test_a_wrong_motor_gives_the_opposite_torque() -> None:
    (motor,) = build_components(ROBOTS["a1"])["motors"]
    row = np.random.default_rng(1).normal(size=60)
    wrong = row.copy()
    wrong[motor.columns] = motor.wrong(row[motor.columns])
    q, v = np.random.default_rng(2).normal(size=(2, 12))

    def torque(numbers: Array) -> Array:
        tau, q_des, v_des, kp, kd = numbers.reshape(5, 12)
        sum_: Array = tau + kp * (q_des - q) + kd * (v_des - v)
        return sum_

    np.testing.assert_allclose(torque(wrong), -torque(row), rtol=1e-12)


def test_a_wrong_attitude_is_a_unit_quaternion_tilted_by_its_angle() -> None:
    attitude, *_ = build_components(ROBOTS["a1"])["imu"]
    for quat in np.random.default_rng(3).normal(size=(20, 4)):
        sound = quat / np.linalg.norm(quat)
        wrong = attitude.wrong(sound)
        assert np.linalg.norm(wrong) == pytest.approx(1.0, abs=1e-12)
        assert 2.0 * np.arccos(abs(wrong @ sound)) == pytest.approx(0.2, abs=1e-9)
