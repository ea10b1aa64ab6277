"""The links of a trunk with four legs of three joints, and the state of one leg."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.agents.controller.maths.spatial import (
    Inertia,
    Spatial,
    Vector,
    add_spatial,
    add_vectors,
    combine_inertias,
    inertial_force,
    linear_combination,
    motion_cross,
    scale,
    vector_product,
)
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_JOINTS: Final = ("JointModelFreeFlyer", *4 * ("JointModelRX", "JointModelRY", "JointModelRY"))
X: Final = (1.0, 0.0, 0.0)
Y: Final = (0.0, 1.0, 0.0)
Z: Final = (0.0, 0.0, 1.0)
ZERO: Final = (0.0, 0.0, 0.0)


class LinkLayout(NamedTuple):
    """Where a row of `link_table` keeps what.

    Attributes:
        mass: kg.
        com: centre of mass, (3,), m, in the link's frame.
        moments: of inertia about the centre of mass, xx, xy, xz, yy, yz, zz, (6,), kg·m².
        joint: where the link's joint is, (3,), m, in the frame of the link before.
        rotor: inertia of the joint's motor behind its gear, kg·m².
    """

    mass: int
    com: slice
    moments: slice
    joint: slice
    rotor: int


LINK: Final = LinkLayout(**places(mass=1, com=3, moments=6, joint=3, rotor=1))
LINK_SIZE: Final = row_size(LINK)
N_LINKS: Final = 13  # the trunk and three of each leg


def link_table(model: pin.Model) -> Array:
    """What `rigid_body_terms` knows of the trunk and the twelve links, (13, 14), see `LinkLayout`.

    Raises:
        ConfigError: the model is not a trunk with four legs whose joints turn about x, y and y.
    """
    joints = tuple(joint.shortname() for joint in list(model.joints)[1:])
    places, inertias = list(model.jointPlacements)[1:], list(model.inertias)[1:]
    rotated = [place for place in places if not np.array_equal(place.rotation, np.eye(3))]
    if joints != _JOINTS or rotated:
        raise ConfigError(
            "robot",
            f"joints {', '.join(joints)}, {len(rotated)} of them mounted at an angle",
            "four legs with a hip that turns about x, a thigh and a calf about y",
            "another robot",
        )
    upper, rotors = np.triu_indices(3), [0.0, *model.armature[6:]]
    return np.array(
        [
            [link.mass, *link.lever, *link.inertia[upper], *place.translation, rotor]
            for link, place, rotor in zip(inertias, places, rotors, strict=True)
        ]
    )


class LegState(NamedTuple):
    """A leg's three links at one instant, from the hip on, about the trunk's origin in its frame.

    Attributes:
        axes: motion of each link at unit rate of its joint.
        velocity: of each link.
        force: that accelerates each link and what it carries while no joint accelerates.
        inertia: of each link and what it carries.
    """

    axes: tuple[Spatial, Spatial, Spatial]
    velocity: tuple[Spatial, Spatial, Spatial]
    force: tuple[Spatial, Spatial, Spatial]
    inertia: tuple[Inertia, Inertia, Inertia]


@compiled
def leg_state(links: Array, q: Array, rates: Array, trunk: Spatial, gravity: Spatial) -> LegState:
    """The state of a leg, by recursive Newton-Euler and composite rigid bodies.

    Args:
        links: its rows of `link_table`, (3, 14).
        q: its joint angles, (3,), rad.
        rates: its joint rates, (3,), rad/s.
        trunk: motion of the trunk.
        gravity: the acceleration that stands for it.
    """
    # Joint axes, where the joints are, and the axes of the links behind them.
    c, s = np.cos(q[0]), np.sin(q[0])
    y1, z1 = (0.0, c, s), (0.0, -s, c)
    o1 = _joint_position(links[0], X, Y, Z, ZERO)
    o2 = _joint_position(links[1], X, y1, z1, o1)
    x2, z2 = _rotate_about_y(X, z1, q[1])
    o3 = _joint_position(links[2], x2, y1, z2, o2)
    x3, z3 = _rotate_about_y(x2, z2, q[2])
    S1, S2, S3 = (
        (vector_product(o1, X), X),
        (vector_product(o2, y1), y1),
        (vector_product(o3, y1), y1),
    )

    rate1, rate2, rate3 = scale(S1, rates[0]), scale(S2, rates[1]), scale(S3, rates[2])
    v1 = add_spatial(trunk, rate1)
    v2 = add_spatial(v1, rate2)
    v3 = add_spatial(v2, rate3)
    a1 = add_spatial(gravity, motion_cross(v1, rate1))
    a2 = add_spatial(a1, motion_cross(v2, rate2))
    a3 = add_spatial(a2, motion_cross(v3, rate3))

    link1 = link_inertia(links[0], X, y1, z1, o1)
    link2 = link_inertia(links[1], x2, y1, z2, o2)
    link3 = link_inertia(links[2], x3, y1, z3, o3)
    f3 = inertial_force(link3, v3, a3)
    f2 = add_spatial(f3, inertial_force(link2, v2, a2))
    f1 = add_spatial(f2, inertial_force(link1, v1, a1))
    link2 = combine_inertias(link2, link3)
    link1 = combine_inertias(link1, link2)
    return LegState((S1, S2, S3), (v1, v2, v3), (f1, f2, f3), (link1, link2, link3))


@compiled
def link_inertia(link: Array, x: Vector, y: Vector, z: Vector, origin: Vector) -> Inertia:
    """Of a link whose axes are x, y, z and whose frame is at `origin`."""
    mass, com = link[LINK.mass], link[LINK.com]
    xx, xy, xz, yy, yz, zz = link[LINK.moments]
    c = add_vectors(origin, linear_combination(com[0], x, com[1], y, com[2], z))
    h = (mass * c[0], mass * c[1], mass * c[2])
    # The moments about the link's centre: with I e = (xx x + xy y + xz z) and so on.
    u = linear_combination(xx, x, xy, y, xz, z)
    v = linear_combination(xy, x, yy, y, yz, z)
    w = linear_combination(xz, x, yz, y, zz, z)
    return (
        mass,
        h,
        (
            u[0] * x[0] + v[0] * y[0] + w[0] * z[0] + h[1] * c[1] + h[2] * c[2],
            u[0] * x[1] + v[0] * y[1] + w[0] * z[1] - h[0] * c[1],
            u[0] * x[2] + v[0] * y[2] + w[0] * z[2] - h[0] * c[2],
            u[1] * x[1] + v[1] * y[1] + w[1] * z[1] + h[0] * c[0] + h[2] * c[2],
            u[1] * x[2] + v[1] * y[2] + w[1] * z[2] - h[1] * c[2],
            u[2] * x[2] + v[2] * y[2] + w[2] * z[2] + h[0] * c[0] + h[1] * c[1],
        ),
    )


@compiled
def _joint_position(link: Array, x: Vector, y: Vector, z: Vector, origin: Vector) -> Vector:
    """Where a link's joint is, on the link before with these axes and origin."""
    joint = link[LINK.joint]
    return add_vectors(origin, linear_combination(joint[0], x, joint[1], y, joint[2], z))


@compiled
def _rotate_about_y(x: Vector, z: Vector, angle: float) -> tuple[Vector, Vector]:
    """Both axes turned about the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    return (
        (c * x[0] - s * z[0], c * x[1] - s * z[1], c * x[2] - s * z[2]),
        (s * x[0] + c * z[0], s * x[1] + c * z[1], s * x[2] + c * z[2]),
    )
