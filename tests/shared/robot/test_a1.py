"""The constants both sides agree on, against the robot's URDF."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest

from quadriga.agents.controller.maths import leg_kinematics as kinematics
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.a1 import (
    FOOT_RADIUS,
    STAND_HEIGHT,
    TORQUE_LIMIT,
    TOTAL_MASS,
    TRUNK_BOX,
    TRUNK_LINK,
    TRUNK_MASS,
    a1_urdf,
    q_stand,
)
from quadriga.shared.robot.conventions import (
    FOOT_FRAMES,
    GRAVITY,
    JOINT_NAMES,
    N_FORCES,
    N_JOINTS,
    N_LEGS,
    N_OUTPUTS,
    OUTPUTS,
    Leg,
    robot_names,
)
from quadriga.shared.robot.pinocchio_model import build_pinocchio_model

MODEL = build_pinocchio_model()
URDF = ET.parse(a1_urdf()).getroot()


def link(name: str) -> ET.Element:
    found = URDF.find(f"link[@name='{name}']")
    assert found is not None
    return found


def numbers(element: ET.Element | None, attribute: str) -> list[float]:
    assert element is not None
    return [float(word) for word in element.get(attribute, "").split()]


def test_joints_are_in_pinocchios_order() -> None:
    assert tuple(MODEL.names)[2:] == JOINT_NAMES
    assert (MODEL.nq, MODEL.nv) == (7 + N_JOINTS, 6 + N_JOINTS)
    assert [leg.name for leg in Leg] == [frame.removesuffix("_foot") for frame in FOOT_FRAMES]
    for leg, frame in zip(Leg, FOOT_FRAMES, strict=True):
        calf = MODEL.frames[MODEL.getFrameId(frame)].parentJoint
        assert MODEL.names[calf] == JOINT_NAMES[3 * leg + 2]


def test_the_mass_is_the_papers_and_only_the_trunk_was_changed() -> None:
    whole = pin.buildModelFromUrdf(str(a1_urdf()), pin.JointModelFreeFlyer())
    assert pin.computeTotalMass(MODEL) == pytest.approx(TOTAL_MASS, abs=5e-4)
    urdfs_trunk = numbers(link(TRUNK_LINK).find("inertial/mass"), "value")[0]
    difference = pin.computeTotalMass(whole) - pin.computeTotalMass(MODEL)
    assert difference == pytest.approx(urdfs_trunk - TRUNK_MASS)
    for i in range(2, MODEL.njoints):
        assert MODEL.inertias[i].isApprox(whole.inertias[i])


def test_the_trunk_keeps_its_centre_and_its_own_inertia() -> None:
    """All that is fixed to the trunk, with the trunk link's mass replaced: Steiner by hand."""
    whole = pin.buildModelFromUrdf(str(a1_urdf()), pin.JointModelFreeFlyer()).inertias[1]
    mass = numbers(link(TRUNK_LINK).find("inertial/mass"), "value")[0]
    centre = np.array(numbers(link(TRUNK_LINK).find("inertial/origin"), "xyz"))
    taken = mass - TRUNK_MASS
    com = (whole.mass * whole.lever - taken * centre) / (whole.mass - taken)

    def about(point: np.ndarray, weight: float, lever: np.ndarray) -> np.ndarray:
        d = lever - point
        shifted: np.ndarray = weight * (d @ d * np.eye(3) - np.outer(d, d))
        return shifted

    inertia = whole.inertia + about(com, whole.mass, whole.lever) - about(com, taken, centre)
    changed = MODEL.inertias[1]
    np.testing.assert_allclose(changed.lever, com, atol=1e-12)
    np.testing.assert_allclose(changed.inertia, inertia, atol=1e-12)


def test_the_torque_limit_is_that_of_every_joint() -> None:
    limits = [
        numbers(joint.find("limit"), "effort")[0]
        for joint in URDF.iter("joint")
        if joint.get("type") == "revolute"
    ]
    assert limits == [TORQUE_LIMIT] * N_JOINTS


def test_feet_and_trunk_have_their_collision_shapes_sizes() -> None:
    for frame in FOOT_FRAMES:
        assert numbers(link(frame).find("collision/geometry/sphere"), "radius") == [FOOT_RADIUS]
    box = link(TRUNK_LINK).find("collision/geometry/box")
    np.testing.assert_allclose(numbers(box, "size"), TRUNK_BOX)


@pytest.mark.parametrize("leg", Leg)
def test_the_legs_dimensions_are_those_of_the_kinematics(leg: Leg) -> None:
    front, left = leg in (Leg.FL, Leg.FR), leg in (Leg.FL, Leg.RL)
    x, y = (1.0 if front else -1.0), (1.0 if left else -1.0)
    expected = {
        f"{leg.name}_hip_joint": [x * kinematics.HIP_X, y * kinematics.HIP_Y, 0.0],
        f"{leg.name}_thigh_joint": [0.0, y * kinematics.THIGH_Y, 0.0],
        f"{leg.name}_calf_joint": [0.0, 0.0, -kinematics.LINK],
        f"{leg.name}_foot_fixed": [0.0, 0.0, -kinematics.LINK],
    }
    for name, offset in expected.items():
        origin = URDF.find(f"joint[@name='{name}']/origin")
        np.testing.assert_allclose(numbers(origin, "xyz"), offset, atol=1e-9)


def test_the_nominal_pose_stands_at_its_height_within_the_joints_limits() -> None:
    data, q = MODEL.createData(), pin.neutral(MODEL)
    q[7:] = q_stand()
    pin.framesForwardKinematics(MODEL, data, q)
    for frame in FOOT_FRAMES:
        height = data.oMf[MODEL.getFrameId(frame)].translation[2]
        assert height == pytest.approx(FOOT_RADIUS - STAND_HEIGHT, abs=1e-12)
    assert (q[7:] > MODEL.lowerPositionLimit[7:]).all()
    assert (q[7:] < MODEL.upperPositionLimit[7:]).all()
    assert q_stand() is not q_stand()


def test_sizes_belong_together() -> None:
    assert (len(Leg), len(JOINT_NAMES), 3 * len(Leg)) == (N_LEGS, N_JOINTS, N_FORCES)
    assert len(OUTPUTS) == N_OUTPUTS
    assert pytest.approx(-MODEL.gravity.linear[2]) == GRAVITY
    assert robot_names(3) == ("r1", "r2", "r3")


def test_a_missing_robot_description_is_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ConfigError, match="make install"):
        a1_urdf()
