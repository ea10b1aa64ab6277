"""A robot's rigid-body model for Pinocchio, with the trunk mass both sides agree on."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.spec import RobotSpec


def build_pinocchio_model(robot: RobotSpec, *, rotors: bool = False) -> pin.Model:
    """A robot on a free flyer: 18 velocities, joints in the order of `JOINT_NAMES`.

    The free flyer's velocity is that of the trunk origin, in the trunk's frame, linear first.
    The trunk link is made to weigh `robot.trunk_mass`, if that is given; its inertia about its own
    centre of mass stays the URDF's. Pinocchio has merged the links that are fixed to the trunk into
    joint 1, so the difference is added as a point mass at the trunk link's centre of mass.

    Args:
        robot: its kind.
        rotors: whether the joints have the inertia of their motors' rotors.

    Raises:
        ConfigError: the URDF is not installed or has no trunk link with an inertia.
    """
    urdf = str(robot.urdf_path())
    model = pin.buildModelFromUrdf(urdf, pin.JointModelFreeFlyer())
    if robot.trunk_mass is not None:
        mass, com = _trunk_mass_com(urdf, robot.trunk_link)
        point = pin.Inertia(robot.trunk_mass - mass, com, np.zeros((3, 3)))
        model.inertias[1] = model.inertias[1] + point
    if rotors:
        model.armature[6:] = robot.rotor_inertias
    return model


def _trunk_mass_com(urdf: str, link: str) -> tuple[float, Array]:
    """Mass and centre of mass of the URDF's trunk link alone, kg and m (trunk frame)."""
    inertial = ET.parse(urdf).find(f"link[@name='{link}']/inertial")
    mass = None if inertial is None else inertial.find("mass")
    origin = None if inertial is None else inertial.find("origin")
    if mass is None or origin is None:
        raise ConfigError(urdf, f"no inertial of link {link!r}", "the robot's URDF")
    return float(mass.get("value", "")), np.array(origin.get("xyz", "").split(), dtype=float)
