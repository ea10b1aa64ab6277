"""Dynamics of a trunk with four legs of three joints, and loops over small matrices.

Motions and forces are spatial vectors as tuples, which compiled code keeps in registers: a pair of
vectors, linear and angular, about the trunk's origin and in its frame (recursive Newton-Euler and
composite rigid bodies: Featherstone, Rigid Body Dynamics Algorithms, 2008, but linear before
angular). Legs act on each other through the trunk alone, so M⁻¹ comes from four 3×3 blocks and one
Schur complement of 6×6. A general library is made for any robot and called once for each term; with
cold caches that cost nearly as much as the rest of the whole-body QP.

Matrices of a dozen rows are multiplied and solved by loops: at these sizes a call of BLAS costs
more than its arithmetic, most of all when its code and buffers have left the caches; and loops give
the same bits on every processor.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from quadriga.agents.estimator.kinematics import rotation_matrix
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.robots.spec import Geometry
from quadriga.shared.runtime.jit import compiled

Vector = tuple[float, float, float]
Axes = tuple[Vector, Vector, Vector]
Spatial = tuple[Vector, Vector]  # of a motion or a force: linear and angular part
Symmetric = tuple[float, float, float, float, float, float]  # xx, xy, xz, yy, yz, zz
Inertia = tuple[float, Vector, Symmetric]  # mass, mass · centre, moments about the trunk's origin

_X: Final = (1.0, 0.0, 0.0)
_TRUNK: Final = (_X, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))  # its axes
_ZERO: Final = (0.0, 0.0, 0.0)

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
def combine(a: Vector | Array, axes: Axes) -> Vector:
    """The vector of the components `a` along these axes."""
    x, y, z = axes
    return (
        a[0] * x[0] + a[1] * y[0] + a[2] * z[0],
        a[0] * x[1] + a[1] * y[1] + a[2] * z[1],
        a[0] * x[2] + a[1] * y[2] + a[2] * z[2],
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
def to_world(axes: Axes, position: Vector, motion: Spatial) -> Spatial:
    """A motion about the trunk's origin, in its frame, as one about the world's, in the world's."""
    angular = combine(motion[1], axes)
    return add_vectors(combine(motion[0], axes), vector_product(position, angular)), angular


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
    p = add_vectors(linear_momentum, vector_product(w, h))
    return p, add_vectors(spin, vector_product(h, linear))


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
        force: that accelerates the whole leg while no joint accelerates.
        inertia: of the whole leg.
        torque: h of its joints, N·m.
        momentum: F, of the links that unit rates of the joints move.
        mass: M = Sᵀ F + diag(rotors) of the joints: a rotor turns its gear's ratio faster than its
            joint, so that only its own joint feels its inertia.
    """

    axes: tuple[Spatial, Spatial, Spatial]
    velocity: tuple[Spatial, Spatial, Spatial]
    force: Spatial
    inertia: Inertia
    torque: Vector
    momentum: tuple[Spatial, Spatial, Spatial]
    mass: Symmetric


@compiled
def leg_state(links: Array, q: Array, rates: Array, trunk: Spatial, gravity: Spatial) -> LegState:
    """The state of a leg at joint angles q, (3,), rad, and rates, (3,), rad/s.

    `links` are its rows of `link_table`, (3, 14), `trunk` is the trunk's motion, `gravity` the
    acceleration that stands for gravity.
    """
    # Places and axes of the links; their joints turn about x, y and y.
    c, s = np.cos(q[0]), np.sin(q[0])
    y1, z1 = (0.0, c, s), (0.0, -s, c)
    x2, z2 = _rotate_about_y(_X, z1, q[1])
    x3, z3 = _rotate_about_y(x2, z2, q[2])
    axes1, axes2, axes3 = (_X, y1, z1), (x2, y1, z2), (x3, y1, z3)
    o1 = combine(links[0, JOINT], _TRUNK)
    o2 = add_vectors(o1, combine(links[1, JOINT], axes1))
    o3 = add_vectors(o2, combine(links[2, JOINT], axes2))
    S1, S2 = (vector_product(o1, _X), _X), (vector_product(o2, y1), y1)
    S3 = (vector_product(o3, y1), y1)

    rate1, rate2, rate3 = scale(S1, rates[0]), scale(S2, rates[1]), scale(S3, rates[2])
    v1 = add_spatial(trunk, rate1)
    v2 = add_spatial(v1, rate2)
    v3 = add_spatial(v2, rate3)
    a1 = add_spatial(gravity, motion_cross(v1, rate1))
    a2 = add_spatial(a1, motion_cross(v2, rate2))
    a3 = add_spatial(a2, motion_cross(v3, rate3))

    link1, link2 = link_inertia(links[0], axes1, o1), link_inertia(links[1], axes2, o2)
    link3 = link_inertia(links[2], axes3, o3)
    f3 = inertial_force(link3, v3, a3)
    f2 = add_spatial(f3, inertial_force(link2, v2, a2))
    f1 = add_spatial(f2, inertial_force(link1, v1, a1))
    link2 = combine_inertias(link2, link3)
    link1 = combine_inertias(link1, link2)
    F1, F2, F3 = momentum_of(link1, S1), momentum_of(link2, S2), momentum_of(link3, S3)
    M11, M12, M13 = power(S1, F1) + links[0, ROTOR], power(S1, F2), power(S1, F3)
    M22, M23, M33 = power(S2, F2) + links[1, ROTOR], power(S2, F3), power(S3, F3) + links[2, ROTOR]
    torque = power(S1, f1), power(S2, f2), power(S3, f3)
    M = M11, M12, M13, M22, M23, M33
    return LegState((S1, S2, S3), (v1, v2, v3), f1, link1, torque, (F1, F2, F3), M)


@compiled
def link_inertia(link: Array, axes: Axes, origin: Vector) -> Inertia:
    """Of a link with these axes, whose frame is at `origin`."""
    mass, (x, y, z) = link[MASS], axes
    xx, xy, xz, yy, yz, zz = link[MOMENTS]
    c = add_vectors(origin, combine(link[COM], axes))
    h = (mass * c[0], mass * c[1], mass * c[2])
    # The moments about the link's centre: with I e = (xx x + xy y + xz z) and so on.
    u, v = combine((xx, xy, xz), axes), combine((xy, yy, yz), axes)
    w = combine((xz, yz, zz), axes)
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

    The trunk's angular acceleration is left out: no sensor measures it. `acceleration` is q̈,
    (12,), rad/s², `specific_force` that of the trunk's origin, (3,), m/s², trunk frame, with
    gravity.

    Returns:
        h − τ and M q̈, (12,) each, N·m.
    """
    wx, wy, wz = state.omega
    ax, ay, az = specific_force
    trunk, gravity = (_ZERO, (wx, wy, wz)), ((ax, ay, az), _ZERO)
    static, inertial = np.empty(12), np.empty(12)
    for leg in range(4):
        k = 3 * leg
        q, rates = state.q_joint[k : k + 3], state.v_joint[k : k + 3]
        moving = leg_state(links[1 + k : 4 + k], q, rates, trunk, gravity)
        for joint in range(3):
            static[k + joint] = moving.torque[joint] - state.tau_joint[k + joint]
        M11, M12, M13, M22, M23, M33 = moving.mass
        a, b, c = acceleration[k], acceleration[k + 1], acceleration[k + 2]
        inertial[k] = M11 * a + M12 * b + M13 * c
        inertial[k + 1] = M12 * a + M22 * b + M23 * c
        inertial[k + 2] = M13 * a + M23 * b + M33 * c
    return static, inertial


@compiled
def foot_forces(torques: Array, q_joint: Array, geometry: Geometry | np.record) -> Array:
    """Forces f on the feet's centres with Jᵀ f = `torques`, (12,), N·m; (4, 3), N, trunk frame.

    Joint angles are (12,), rad. Zero for a leg that is stretched so far that its torques do not
    tell the force.
    """
    out, link = np.zeros((4, 3)), geometry.link
    for leg in range(4):
        first, y = 3 * leg, geometry.thigh_y if leg % 2 == 0 else -geometry.thigh_y
        hip, thigh = q_joint[first], q_joint[first + 1]
        calf = thigh + q_joint[first + 2]
        # In the hip frame, before the roll by the hip angle about x; of thigh and calf.
        ca, sa = np.cos(hip), np.sin(hip)
        sb, cb, sc, cc = np.sin(thigh), np.cos(thigh), np.sin(calf), np.cos(calf)
        sb, cb, sc, cc = link * sb, link * cb, link * sc, link * cc
        z = -(cb + cc)
        J1 = (0.0, -sa * y - ca * z, ca * y - sa * z)
        J2 = (z, -sa * (sb + sc), ca * (sb + sc))
        J3 = (-cc, -sa * sc, ca * sc)
        n1, n2, n3 = vector_product(J2, J3), vector_product(J3, J1), vector_product(J1, J2)
        volume = J1[0] * n1[0] + J1[1] * n1[1] + J1[2] * n1[2]
        if abs(volume) < _STRETCHED * link**3:
            continue
        t1, t2, t3 = torques[first], torques[first + 1], torques[first + 2]
        for axis in range(3):
            out[leg, axis] = (t1 * n1[axis] + t2 * n2[axis] + t3 * n3[axis]) / volume
    return out


class RigidBodyTerms(NamedTuple):
    """Terms of M(q) v̇ + h(q, v) = S τ + Jᵀ f at one instant (Pinocchio's coordinates).

    Attributes:
        M_inverse: inverse mass matrix, (18, 18).
        nle: Coriolis, centrifugal and gravity terms h, (18,).
        J: spatial Jacobians of all joints, world frame, (6, 18), linear rows first.
        dJ: its time derivative, (6, 18).
    """

    M_inverse: Array
    nle: Array
    J: Array
    dJ: Array


@compiled
def rigid_body_terms(q: Array, v: Array, links: Array) -> RigidBodyTerms:
    """The terms of the equation of motion, by Pinocchio's configuration and velocity.

    q is (19,), its quaternion normalised, v is (18,).
    """
    M_inverse, nle = np.zeros((18, 18)), np.empty(18)
    J, dJ = np.empty((6, 18)), np.empty((6, 18))
    R = rotation_matrix(np.array([q[6], q[3], q[4], q[5]]))
    position = (q[0], q[1], q[2])
    velocity = ((v[0], v[1], v[2]), (v[3], v[4], v[5]))
    x, y, z = (R[0, 0], R[1, 0], R[2, 0]), (R[0, 1], R[1, 1], R[2, 1]), (R[0, 2], R[1, 2], R[2, 2])
    axes = (x, y, z)
    motion = to_world(axes, position, velocity)
    for k in range(3):
        _set_columns(J, dJ, k, (axes[k], _ZERO), motion)
        _set_columns(J, dJ, 3 + k, (vector_product(position, axes[k]), axes[k]), motion)
    # Gravity is an acceleration of the whole frame upwards.
    gravity = ((GRAVITY * R[2, 0], GRAVITY * R[2, 1], GRAVITY * R[2, 2]), _ZERO)
    whole = link_inertia(links[0], _TRUNK, _ZERO)
    force = inertial_force(whole, velocity, gravity)
    reaction = np.zeros((6, 12))  # F D⁻¹: what the trunk feels of the legs' joints
    reduced = np.zeros((6, 6))
    for leg in range(4):
        first = 6 + 3 * leg
        rows, rates = links[1 + 3 * leg : 4 + 3 * leg], v[first : first + 3]
        state = leg_state(rows, q[7 + 3 * leg : 10 + 3 * leg], rates, velocity, gravity)
        force = add_spatial(force, state.force)
        whole = combine_inertias(whole, state.inertia)
        _eliminate(state, leg, reaction, reduced, M_inverse)
        for k in range(3):
            nle[first + k] = state.torque[k]
            axis, motion = state.axes[k], to_world(axes, position, state.velocity[k])
            _set_columns(J, dJ, first + k, to_world(axes, position, axis), motion)
    for i in range(3):
        nle[i], nle[3 + i] = force[0][i], force[1][i]
    _complete_inverse(whole, reaction, reduced, M_inverse)
    return RigidBodyTerms(M_inverse, nle, J, dJ)


@compiled
def _set_columns(J: Array, dJ: Array, column: int, axis: Spatial, motion: Spatial) -> None:
    """A column of J, a joint's axis, and its derivative, as it moves with `motion`."""
    derivative = motion_cross(motion, axis)
    for i in range(3):
        J[i, column], J[3 + i, column] = axis[0][i], axis[1][i]
        dJ[i, column], dJ[3 + i, column] = derivative[0][i], derivative[1][i]


@compiled
def _eliminate(
    state: LegState, leg: int, reaction: Array, reduced: Array, M_inverse: Array
) -> None:
    """Fill F D⁻¹ of a leg and its D⁻¹, subtract F D⁻¹ Fᵀ from the trunk's block; D is its mass."""
    (F1, F2, F3), (xx, xy, xz, yy, yz, zz) = state.momentum, state.mass
    p, q, r = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d = 1.0 / (xx * p + xy * q + xz * r)
    yy, yz, zz = d * (xx * zz - xz * xz), d * (xy * xz - xx * yz), d * (xx * yy - xy * xy)
    xx, xy, xz = d * p, d * q, d * r
    first = 3 * leg
    for i in range(6):  # no products of matrices, which would allocate each of them
        part, k = i // 3, i % 3
        a, b, c = F1[part][k], F2[part][k], F3[part][k]
        x, y, z = a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz + c * zz
        reaction[i, first], reaction[i, first + 1], reaction[i, first + 2] = x, y, z
        for j in range(i + 1):
            part, k = j // 3, j % 3
            reduced[i, j] -= x * F1[part][k] + y * F2[part][k] + z * F3[part][k]
    block = M_inverse[6 + first : 9 + first, 6 + first : 9 + first]
    block[0, 0], block[1, 1], block[2, 2] = xx, yy, zz
    block[0, 1], block[0, 2], block[1, 2] = xy, xz, yz
    block[1, 0], block[2, 0], block[2, 1] = xy, xz, yz


@compiled
def _complete_inverse(whole: Inertia, reaction: Array, reduced: Array, M_inverse: Array) -> None:
    """Complete M⁻¹ from the inertia of the whole robot and what `_eliminate` left."""
    trunk = np.eye(6)
    for k in range(6):
        e = trunk[k]
        momentum = momentum_of(whole, ((e[0], e[1], e[2]), (e[3], e[4], e[5])))
        for i in range(6):
            reduced[i, k] += momentum[i // 3][i % 3]
    cholesky_solve(cholesky(reduced), trunk)
    coupled = product(trunk, reaction)
    M_inverse[:6, :6] = trunk
    M_inverse[:6, 6:] = -coupled
    for i in range(12):
        for j in range(6):
            M_inverse[6 + i, j] = -coupled[j, i]
            for k in range(12):
                M_inverse[6 + i, 6 + k] += reaction[j, i] * coupled[j, k]


@compiled
def dot(x: Array, y: Array) -> float:
    """xᵀ y. Shapes (k,), (k,)."""
    total = 0.0
    for k in range(len(x)):
        total += x[k] * y[k]
    return total


@compiled
def times(A: Array, x: Array) -> Array:
    """A x. Shapes (m, k), (k,)."""
    y = np.zeros(A.shape[0])
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            y[i] += A[i, k] * x[k]
    return y


@compiled
def product(A: Array, B: Array) -> Array:
    """A B. Shapes (m, k), (k, n)."""
    C = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            a = A[i, k]
            for j in range(B.shape[1]):
                C[i, j] += a * B[k, j]
    return C


@compiled
def add_gram(weight: float, A: Array, H: Array) -> None:
    """Add weight · Aᵀ A to the lower triangle of H. Shapes (k, n), (n, n)."""
    for k in range(A.shape[0]):
        for i in range(A.shape[1]):
            a = weight * A[k, i]
            for j in range(i + 1):
                H[i, j] += a * A[k, j]


@compiled
def cholesky(H: Array) -> Array:
    """The lower Cholesky factor of H, (n, n), of which the lower triangle is read.

    NaN where H is not positive definite.
    """
    n = H.shape[0]
    L = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                L[i, i] = np.sqrt(total) if total > 0.0 else np.nan
            else:
                L[i, j] = total / L[j, j]
    return L


@compiled
def cholesky_solve(L: Array, B: Array) -> None:
    """Replace B, (n, m), by (L Lᵀ)⁻¹ B."""
    n, m = B.shape
    for i in range(n):
        for k in range(i):
            for j in range(m):
                B[i, j] -= L[i, k] * B[k, j]
        for j in range(m):
            B[i, j] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            for j in range(m):
                B[i, j] -= L[k, i] * B[k, j]
        for j in range(m):
            B[i, j] /= L[i, i]
