"""One robot as MuJoCo bodies, built from the same URDF that Pinocchio reads."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any, Final

import mujoco
import numpy as np

from quadriga.shared.config.sections import MotorsConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import FOOT_FRAMES, JOINT_NAMES, Array, Leg
from quadriga.shared.robots.spec import RobotSpec
from quadriga.sim_server.terrain.terrain import LEG_CONTACT, NO_CONTACT, ROBOT_CONTACT

TRUNK: Final = "trunk"  # the trunk's body and box, whatever the URDF calls its link
VISUAL_GROUP: Final = 1
FOOT_SOLREF: Final = (0.01, 1.0)  # s, damping ratio
_TOUCH: Final = 1.5  # radius of the touch sensor over the foot's: every contact lies inside
_LIMB_RGBA: Final = (0.25, 0.26, 0.28, 1.0)
_FOOT_RGBA: Final = (0.1, 0.1, 0.1, 1.0)
# m. Thigh and calf are as thick as the boxes of the A1's and Go1's URDF, the hip is its motor.
_LIMB_RADIUS: Final = {"hip": 0.04, "thigh": 0.016, "calf": 0.01}
_NEXT: Final = {"hip": "thigh", "thigh": "calf", "calf": "foot"}
_LIMB_SOLREF: Final = (0.01, 1.0)  # s, damping ratio
_STOP_SOLREF: Final = (0.003, 1.0)  # s, damping ratio, of a joint's end stops


class RobotBody:
    """The URDF's tree of links, ready to be added to a world any number of times.

    Children are added in the order of their joints' names, which is Pinocchio's joint order, so
    joint vectors need no permutation between the two. Links on fixed joints become welded bodies.

    With `leg_collisions` its limbs touch the ground and other legs.

    Raises:
        ConfigError: the URDF is not installed or uses something this parser does not know.
    """

    def __init__(self, robot: RobotSpec, motors: MotorsConfig, *, leg_collisions: bool) -> None:
        self._robot, self._motors = robot, motors
        self._contact = LEG_CONTACT if leg_collisions else ROBOT_CONTACT
        of_limbs = {"hip": ROBOT_CONTACT, "thigh": LEG_CONTACT, "calf": LEG_CONTACT}
        self._limb = of_limbs if leg_collisions else dict.fromkeys(of_limbs, NO_CONTACT)
        root = robot.urdf_tree()
        self._links = {str(link.get("name")): link for link in root.findall("link")}
        self._joints: dict[str, list[ET.Element]] = {name: [] for name in self._links}
        for joint in sorted(root.findall("joint"), key=lambda item: str(item.get("name"))):
            self._joints[_child(joint, "parent").get("link", "")].append(joint)

    def add_to(
        self,
        spec: mujoco.MjSpec,
        prefix: str,
        pos: tuple[float, float, float],
        friction: float,
        rgba: tuple[float, float, float, float],
    ) -> mujoco.MjsBody:
        """Add one robot on a free joint, level and with yaw zero; its trunk body.

        Args:
            spec: the world under construction.
            prefix: put before every name of the robot, e.g. `r1/`.
            pos: of the trunk's origin, world, m.
            friction: sliding friction of feet and trunk on the terrain.
            rgba: colour of the trunk.
        """
        robot = self._robot
        surface = {"mass": 0.0, "priority": 1, "friction": [friction, 0.005, 0.0001]}
        trunk = spec.worldbody.add_body(name=prefix + TRUNK, pos=pos)
        trunk.add_freejoint(name=prefix + "free")
        trunk.add_site(name=prefix + "imu", pos=robot.imu, group=4)
        trunk.add_geom(
            name=prefix + TRUNK,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[length / 2 for length in robot.trunk_box],
            rgba=rgba,
            **surface,
            **self._contact,
        )
        self._fill(trunk, robot.trunk_link, prefix, surface)
        for leg in Leg:
            # The hip lies between them, and its range keeps them apart, but a box is no shell.
            spec.add_exclude(bodyname1=prefix + TRUNK, bodyname2=f"{prefix}{leg.name}_thigh")
        return trunk

    def _fill(self, body: mujoco.MjsBody, link: str, prefix: str, surface: dict[str, Any]) -> None:
        _set_inertia(body, self._links[link])
        if link in FOOT_FRAMES:
            sphere, radius = mujoco.mjtGeom.mjGEOM_SPHERE, self._robot.geometry.foot_radius
            foot = {"name": prefix + link, "type": sphere}
            look = {"rgba": _FOOT_RGBA, "solref": FOOT_SOLREF}
            body.add_geom(size=[radius, 0.0, 0.0], **foot, **look, **surface, **self._contact)
            body.add_site(size=[_TOUCH * radius, 0.0, 0.0], group=4, **foot)
        for joint in self._joints[link]:
            name = _child(joint, "child").get("link", "")
            kind = joint.get("type")
            if kind == "fixed" and not _mass(self._links[name]):
                continue  # only a frame, which neither MuJoCo nor the controller needs
            pos = _origin(joint)
            child = body.add_body(name=prefix + name, pos=pos, quat=_rotation(joint))
            if kind == "revolute":
                self._add_joint(child, joint, prefix)
            elif kind != "fixed":
                got, expected = f"a joint of type {kind!r}", "fixed or revolute"
                raise ConfigError("the robot's URDF", got, expected)
            self._add_limb(body, link, name, pos, surface)
            self._fill(child, name, prefix, surface)

    def _add_joint(self, body: mujoco.MjsBody, joint: ET.Element, prefix: str) -> None:
        name, limit = str(joint.get("name")), _child(joint, "limit")
        added = body.add_joint(
            name=prefix + name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=_numbers(_child(joint, "axis").get("xyz", "")),
            limited=1,
            range=[float(limit.get("lower", "")), float(limit.get("upper", ""))],
        )
        if self._motors.hard_stops:
            added.solref_limit = _STOP_SOLREF
        if self._motors.rotor_inertia:
            added.armature = float(self._robot.rotor_inertias[JOINT_NAMES.index(name)])

    def _add_limb(
        self, body: mujoco.MjsBody, link: str, child: str, end: list[float], surface: dict[str, Any]
    ) -> None:
        """A capsule from the link's origin to its child's, without mass."""
        leg, _, part = link.partition("_")
        if part not in _LIMB_RADIUS:
            return
        # Covers of motors hang on a link as its children too, but the limb leads to the next one.
        contact = self._limb[part] if child == f"{leg}_{_NEXT[part]}" else NO_CONTACT
        capsule, size = mujoco.mjtGeom.mjGEOM_CAPSULE, [_LIMB_RADIUS[part], 0.0, 0.0]
        look = {"rgba": _LIMB_RGBA, "group": VISUAL_GROUP, "solref": _LIMB_SOLREF}
        fromto = [0.0, 0.0, 0.0, *end]
        body.add_geom(type=capsule, fromto=fromto, size=size, **look, **surface, **contact)


def _set_inertia(body: mujoco.MjsBody, link: ET.Element) -> None:
    inertial = _child(link, "inertial")
    tensor: Mapping[str, str] = _child(inertial, "inertia").attrib
    body.explicitinertial = True
    body.mass = _mass(link)
    body.ipos = _origin(inertial)
    xx, yy, zz, xy, xz, yz = (float(tensor[k]) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, _rotation(inertial))
    R = flat.reshape(3, 3)
    turned = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    body.fullinertia = [*np.diag(turned), turned[0, 1], turned[0, 2], turned[1, 2]]


def _mass(link: ET.Element) -> float:
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else float(mass.get("value", ""))


def _origin(element: ET.Element) -> list[float]:
    """Translation of an element's origin, m."""
    origin = element.find("origin")
    return [0.0, 0.0, 0.0] if origin is None else _numbers(origin.get("xyz", "0 0 0"))


def _rotation(element: ET.Element) -> Array:
    """Rotation of an element's origin, quaternion wxyz: about the fixed x, then y, then z."""
    origin, quat = element.find("origin"), np.array([1.0, 0.0, 0.0, 0.0])
    rpy = [0.0, 0.0, 0.0] if origin is None else _numbers(origin.get("rpy", "0 0 0"))
    if any(rpy):
        mujoco.mju_euler2Quat(quat, rpy, "XYZ")
    return quat


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _child(element: ET.Element, tag: str) -> ET.Element:
    child = element.find(tag)
    if child is None:
        raise ConfigError("the robot's URDF", f"<{element.tag}> without <{tag}>", f"a <{tag}>")
    return child
