"""What the records of the robots say, against the robots' URDFs."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import FOOT_FRAMES, JOINT_NAMES, N_JOINTS, Leg
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.spec import RobotSpec

every_robot = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS.keys())


@lru_cache
def urdf_of(kind: str) -> ET.Element:
    return ET.parse(ROBOTS[kind].urdf_path()).getroot()


@lru_cache
def model_of(kind: str) -> pin.Model:
    return build_pinocchio_model(ROBOTS[kind])


def link(robot: RobotSpec, name: str) -> ET.Element:
    found = urdf_of(robot.kind).find(f"link[@name='{name}']")
    assert found is not None
    return found


def numbers(element: ET.Element | None, attribute: str) -> list[float]:
    assert element is not None
    return [float(word) for word in element.get(attribute, "").split()]


@every_robot
def test_joints_are_in_pinocchios_order_and_the_mass_is_the_models(robot: RobotSpec) -> None:
    model = model_of(robot.kind)
    assert tuple(model.names)[2:] == JOINT_NAMES
    assert (model.nq, model.nv) == (7 + N_JOINTS, 6 + N_JOINTS)
    assert [leg.name for leg in Leg] == [frame.removesuffix("_foot") for frame in FOOT_FRAMES]
    for leg, frame in zip(Leg, FOOT_FRAMES, strict=True):
        calf = model.frames[model.getFrameId(frame)].parentJoint
        assert model.names[calf] == JOINT_NAMES[3 * leg + 2]
    assert pin.computeTotalMass(model) == pytest.approx(robot.mass, abs=5e-4)


def test_the_a1_is_that_of_12_kg_and_not_the_urdfs() -> None:
    """Trunk link and IMU put together by hand; the legs' links are those of the URDF."""
    model = model_of("a1")
    com, imu = np.array([0.012731, 0.002186, 0.000515]), 0.001
    own = np.diag([0.01683993, 0.056579028, 0.064713601])
    own[[0, 0, 1], [1, 2, 2]] = own[[1, 2, 2], [0, 0, 1]] = 8.3902e-05, 0.000597679, 2.5134e-05
    reduced = 4.713 * imu / (4.713 + imu)
    inertia = own + reduced * (com @ com * np.eye(3) - np.outer(com, com)) + 1e-4 * np.eye(3)
    assert model.inertias[1].mass == pytest.approx(4.713 + imu)
    np.testing.assert_allclose(model.inertias[1].lever, com * 4.713 / (4.713 + imu), atol=1e-12)
    np.testing.assert_allclose(model.inertias[1].inertia, inertia, atol=1e-12)
    whole = pin.buildModelFromUrdf(str(A1.urdf_path()), pin.JointModelFreeFlyer())
    assert all(model.inertias[i].isApprox(whole.inertias[i]) for i in range(2, model.njoints))


@every_robot
def test_limits_of_position_are_the_urdfs_and_motors_have_no_more(robot: RobotSpec) -> None:
    """The Go2's motors have what Unitree's torque-speed curve says: less than its URDF."""
    model = model_of(robot.kind)
    share = 1.0 if robot.kind == "go2" else 0.0
    np.testing.assert_allclose(robot.torque_limit, model.effortLimit[6:], rtol=0.02 * share)
    np.testing.assert_allclose(np.tile(robot.speed, 4), model.velocityLimit[6:], rtol=0.01 * share)
    assert (robot.torque_limit <= model.effortLimit[6:]).all()
    np.testing.assert_allclose(model.lowerPositionLimit[7:], robot.lower, atol=1e-9)
    np.testing.assert_allclose(model.upperPositionLimit[7:], robot.upper, atol=1e-9)


@every_robot
def test_trunk_imu_legs_and_feet_have_their_sizes_and_places(robot: RobotSpec) -> None:
    """Where the URDF has a mesh instead of a sphere or box, Unitree's MJCF gives the size."""
    model, geometry = model_of(robot.kind), robot.geometry
    box = link(robot, robot.trunk_link).find("collision/geometry/box")
    if box is not None:
        np.testing.assert_allclose(numbers(box, "size"), robot.trunk_box)
    imu = model.frames[model.getFrameId("imu_joint")].placement
    np.testing.assert_allclose(imu.translation, robot.imu, atol=1e-9)
    np.testing.assert_allclose(imu.rotation, np.eye(3), atol=1e-12)
    for leg in Leg:
        sphere = link(robot, f"{leg.name}_foot").find("collision/geometry/sphere")
        if sphere is not None:
            assert numbers(sphere, "radius") == [geometry.foot_radius]
        x, y = (1.0 if leg.name[0] == "F" else -1.0), (1.0 if leg.name[1] == "L" else -1.0)
        expected = {
            f"{leg.name}_hip_joint": [x * geometry.hip_x, y * geometry.hip_y, 0.0],
            f"{leg.name}_thigh_joint": [0.0, y * geometry.thigh_y, 0.0],
            f"{leg.name}_calf_joint": [0.0, 0.0, -geometry.link],
        }
        for name, offset in expected.items():
            place = model.jointPlacements[model.getJointId(name)]
            np.testing.assert_allclose(place.translation, offset, atol=1e-9)
        foot = model.frames[model.getFrameId(f"{leg.name}_foot")].placement
        np.testing.assert_allclose(foot.translation, [0.0, 0.0, -geometry.link], atol=1e-9)


@every_robot
def test_the_nominal_pose_stands_at_its_height_within_the_joints_limits(robot: RobotSpec) -> None:
    model = model_of(robot.kind)
    data, q = model.createData(), pin.neutral(model)
    q[7:] = robot.q_stand
    pin.framesForwardKinematics(model, data, q)
    for frame in FOOT_FRAMES:
        height = data.oMf[model.getFrameId(frame)].translation[2]
        assert height == pytest.approx(robot.geometry.foot_radius - robot.stand_height, abs=1e-12)
    assert (q[7:] > robot.lower).all()
    assert (q[7:] < robot.upper).all()
    assert not robot.q_stand.flags.writeable
    stretched = 2.0 * robot.geometry.link * np.cos(0.5 * robot.upper[2])
    assert stretched - 0.01 < robot.reach < stretched, "no farther than the knee's stop allows"


def test_a_description_that_is_missing_or_another_is_one_clear_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(ConfigError, match="wing"):
        replace(A1, urdf_changes={"link[@name='wing']": {}}).urdf_tree()
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ConfigError, match="make install"):
        A1.urdf_path()
