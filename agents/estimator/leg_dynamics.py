"""Dynamics of a trunk with four legs of three joints: links, one leg's state, forces on the feet.

Motions and forces are spatial vectors as tuples, which compiled code keeps in registers: a pair of
vectors, linear and angular, about the trunk's origin and in its frame (Featherstone, Rigid Body
Dynamics Algorithms, 2008, but linear before angular).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.spec import Geometry, RobotSpec
from quadriga.shared.runtime.jit import compiled

Vector = tuple[float, float, float]
Spatial = tuple[Vector, Vector]  # of a motion or a force: linear and angular part
Symmetric = tuple[float, float, float, float, float, float]  # xx, xy, xz, yy, yz, zz
Inertia = tuple[float, Vector, Symmetric]  # mass, mass · centre, moments about the trunk's origin


X: Final = (1.0, 0.0, 0.0)
Y: Final = (0.0, 1.0, 0.0)
Z: Final = (0.0, 0.0, 1.0)
ZERO: Final = (0.0, 0.0, 0.0)

# Columns of `link_table`: mass, kg; centre of mass in the frame of the link, m; moments of inertia
# about it, xx, xy, xz, yy, yz, zz, kg·m²; place of its joint in the frame of the link before, m;
# inertia of the motor of the joint behind its gear, kg·m².
MASS: Final = 0
COM: Final = slice(1, 4)
MOMENTS: Final = slice(4, 10)
JOINT: Final = slice(10, 13)
ROTOR: Final = 13
LINK_SIZE: Final = 14
N_LINKS: Final = 13  # the trunk and three of each leg

_JOINTS: Final = ("JointModelFreeFlyer", *4 * ("JointModelRX", "JointModelRY", "JointModelRY"))
_STRETCHED: Final = 0.1  # of the volume that a leg's Jacobian spans, in cubes of the thigh's length


class RigidBody(NamedTuple):
    """What is constant of one robot's body, by Pinocchio's model of its URDF.

    Attributes:
        links: `link_table`.
        mass: kg.
        com: centre of mass in the nominal pose, (3,), m, trunk frame.
        inertia_inverse: inverse of the inertia about it, (3, 3), 1/(kg·m²), trunk frame.
    """

    links: Array
    mass: float
    com: Array
    inertia_inverse: Array


def rigid_body(robot: RobotSpec, *, rotors: bool = False) -> RigidBody:
    """The body of a robot; with `rotors` its joints have the inertia of their motors' rotors."""
    model = build_pinocchio_model(robot, rotors=rotors)
    q, scratch = pin.neutral(model), model.createData()
    q[7:] = robot.q_stand
    pin.ccrba(model, scratch, q, np.zeros(model.nv))
    com = np.array(pin.centerOfMass(model, scratch, q))
    inverse = np.linalg.inv(scratch.Ig.inertia)
    return RigidBody(link_table(model), float(pin.computeTotalMass(model)), com, inverse)


def link_table(model: pin.Model) -> Array:
    """The trunk and the twelve links, (13, 14), see `MASS` and the columns behind it.

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


@compiled
def add_vectors(a: Vector, b: Vector) -> Vector:
    """The sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def vector_product(a: Vector, b: Vector) -> Vector:
    """The vector product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def linear_combination(a: float, x: Vector, b: float, y: Vector, c: float, z: Vector) -> Vector:
    """The vector a x + b y + c z."""
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
    )


@compiled
def rotate(R: Array, a: Vector) -> Vector:
    """The vector R a."""
    return (
        R[0, 0] * a[0] + R[0, 1] * a[1] + R[0, 2] * a[2],
        R[1, 0] * a[0] + R[1, 1] * a[1] + R[1, 2] * a[2],
        R[2, 0] * a[0] + R[2, 1] * a[1] + R[2, 2] * a[2],
    )


@compiled
def add_spatial(a: Spatial, b: Spatial) -> Spatial:
    """The sum of two motions, or of two forces."""
    return add_vectors(a[0], b[0]), add_vectors(a[1], b[1])


@compiled
def scale(a: Spatial, factor: float) -> Spatial:
    """A motion or force times a factor."""
    (x, y, z), (p, q, r) = a
    return (factor * x, factor * y, factor * z), (factor * p, factor * q, factor * r)


@compiled
def power(motion: Spatial, force: Spatial) -> float:
    """The power of a force in a motion."""
    (x, y, z), (p, q, r) = motion
    (a, b, c), (d, e, f) = force
    return x * a + y * b + z * c + p * d + q * e + r * f


@compiled
def motion_cross(a: Spatial, b: Spatial) -> Spatial:
    """How b, fixed to a body that moves with a, changes."""
    linear = add_vectors(vector_product(a[1], b[0]), vector_product(a[0], b[1]))
    return linear, vector_product(a[1], b[1])


@compiled
def to_world(R: Array, position: Vector, motion: Spatial) -> Spatial:
    """A motion about the trunk's origin, in its frame, as one about the world's, in the world's."""
    angular = rotate(R, motion[1])
    return add_vectors(rotate(R, motion[0]), vector_product(position, angular)), angular


@compiled
def combine_inertias(a: Inertia, b: Inertia) -> Inertia:
    """Of two bodies that move as one."""
    i, j = a[2], b[2]
    return (
        a[0] + b[0],
        add_vectors(a[1], b[1]),
        (i[0] + j[0], i[1] + j[1], i[2] + j[2], i[3] + j[3], i[4] + j[4], i[5] + j[5]),
    )


@compiled
def momentum_of(inertia: Inertia, motion: Spatial) -> Spatial:
    """I V: with h = m c, linear m v + ω × h, angular h × v + I ω."""
    mass, h, (xx, xy, xz, yy, yz, zz) = inertia
    linear, w = motion
    spin = (
        xx * w[0] + xy * w[1] + xz * w[2],
        xy * w[0] + yy * w[1] + yz * w[2],
        xz * w[0] + yz * w[1] + zz * w[2],
    )
    linear_momentum = (mass * linear[0], mass * linear[1], mass * linear[2])
    return (
        add_vectors(linear_momentum, vector_product(w, h)),
        add_vectors(spin, vector_product(h, linear)),
    )


@compiled
def inertial_force(inertia: Inertia, motion: Spatial, acceleration: Spatial) -> Spatial:
    """I A + V ×* I V."""
    p, momentum = momentum_of(inertia, motion)
    linear, w = motion
    f, n = momentum_of(inertia, acceleration)
    torque = add_vectors(vector_product(w, momentum), vector_product(linear, p))
    return add_vectors(f, vector_product(w, p)), add_vectors(n, torque)


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
    mass, com = link[MASS], link[COM]
    xx, xy, xz, yy, yz, zz = link[MOMENTS]
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
    joint = link[JOINT]
    return add_vectors(origin, linear_combination(joint[0], x, joint[1], y, joint[2], z))


@compiled
def _rotate_about_y(x: Vector, z: Vector, angle: float) -> tuple[Vector, Vector]:
    """Both axes turned about the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    return (
        (c * x[0] - s * z[0], c * x[1] - s * z[1], c * x[2] - s * z[2]),
        (s * x[0] + c * z[0], s * x[1] + c * z[1], s * x[2] + c * z[2]),
    )


@compiled
def reaction_torques(
    state: np.record, acceleration: Array, specific_force: Array, links: Array
) -> tuple[Array, Array]:
    """Torques M q̈ + h − τ = Jᵀ f that the ground's forces have in the joints.

    The trunk's angular acceleration is left out: no sensor measures it.

    Args:
        state: `ROBOT_STATE`, of which q_joint, v_joint, tau_joint and omega are read.
        acceleration: q̈ of the joints, (12,), rad/s².
        specific_force: of the trunk's origin, (3,), m/s², trunk frame: gravity and acceleration.
        links: `link_table`.

    Returns:
        h − τ and M q̈, (12,) each, N·m.
    """
    wx, wy, wz = state.omega
    ax, ay, az = specific_force
    trunk, gravity = (ZERO, (wx, wy, wz)), ((ax, ay, az), ZERO)
    static, inertial, tau = np.empty(12), np.empty(12), state.tau_joint
    for leg in range(4):
        k = 3 * leg
        rows = links[1 + k : 4 + k]
        moving = leg_state(rows, state.q_joint[k : k + 3], state.v_joint[k : k + 3], trunk, gravity)
        (S1, S2, S3), (link1, link2, link3) = moving.axes, moving.inertia
        f1, f2, f3 = moving.force
        static[k], static[k + 1] = power(S1, f1) - tau[k], power(S2, f2) - tau[k + 1]
        static[k + 2] = power(S3, f3) - tau[k + 2]
        F1, F2, F3 = momentum_of(link1, S1), momentum_of(link2, S2), momentum_of(link3, S3)
        M12, M13, M23 = power(S1, F2), power(S1, F3), power(S2, F3)
        a, b, c = acceleration[k], acceleration[k + 1], acceleration[k + 2]
        M11, M22 = power(S1, F1) + rows[0, ROTOR], power(S2, F2) + rows[1, ROTOR]
        M33 = power(S3, F3) + rows[2, ROTOR]
        inertial[k] = M11 * a + M12 * b + M13 * c
        inertial[k + 1] = M12 * a + M22 * b + M23 * c
        inertial[k + 2] = M13 * a + M23 * b + M33 * c
    return static, inertial


@compiled
def foot_forces(torques: Array, q_joint: Array, geometry: Geometry | np.record) -> Array:
    """Forces f on the feet's centres with Jᵀ f = `torques`, (4, 3), N, trunk frame.

    Zero for a leg that is stretched so far that its torques do not tell the force.

    Args:
        torques: `reaction_torques`, (12,), N·m.
        q_joint: joint angles, (12,), rad.
        geometry: of the legs, or `GAINS`.
    """
    out = np.zeros((4, 3))
    for leg in range(4):
        first = 3 * leg
        J1, J2, J3 = _foot_jacobian(leg, q_joint[first : first + 3], geometry)
        n1, n2, n3 = vector_product(J2, J3), vector_product(J3, J1), vector_product(J1, J2)
        volume = J1[0] * n1[0] + J1[1] * n1[1] + J1[2] * n1[2]
        if abs(volume) < _STRETCHED * geometry.link**3:
            continue
        t1, t2, t3 = torques[first], torques[first + 1], torques[first + 2]
        for axis in range(3):
            out[leg, axis] = (t1 * n1[axis] + t2 * n2[axis] + t3 * n3[axis]) / volume
    return out


@compiled
def _foot_jacobian(
    leg: int, q: Array, geometry: Geometry | np.record
) -> tuple[Vector, Vector, Vector]:
    """Velocities of a foot's centre at unit rate of its joints, trunk frame, m."""
    side = 1.0 if leg % 2 == 0 else -1.0
    link, y = geometry.link, side * geometry.thigh_y
    ca, sa = np.cos(q[0]), np.sin(q[0])
    # In the hip frame, before the roll by the hip angle about x; of thigh and calf.
    sb, cb = link * np.sin(q[1]), link * np.cos(q[1])
    sc, cc = link * np.sin(q[1] + q[2]), link * np.cos(q[1] + q[2])
    z = -(cb + cc)
    return (
        (0.0, -sa * y - ca * z, ca * y - sa * z),
        (z, -sa * (sb + sc), ca * (sb + sc)),
        (-cc, -sa * sc, ca * sc),
    )
