"""A robot's rigid-body model for Pinocchio, of the description that both sides agree on."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pinocchio as pin

from quadriga.shared.robots.spec import RobotSpec


def build_pinocchio_model(robot: RobotSpec, *, rotors: bool = False) -> pin.Model:
    """A robot on a free flyer: 18 velocities, joints in the order of `JOINT_NAMES`.

    The free flyer's velocity is that of the trunk origin, in the trunk's frame, linear first.
    With `rotors` the joints have the inertia of their motors' rotors.

    Raises:
        ConfigError: the URDF is not installed or is not the one that the robot's record changes.
    """
    urdf = ET.tostring(robot.urdf_tree(), encoding="unicode")
    model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    if rotors:
        model.armature[6:] = robot.rotor_inertias
    return model
