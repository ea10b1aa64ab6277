"""Spatial vectors and inertias as tuples, which compiled code keeps in registers.

A motion or a force is a pair of vectors, linear and angular, about one point and in one frame
(Featherstone, Rigid Body Dynamics Algorithms, 2008, but linear before angular).
"""

from __future__ import annotations

from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

Vector = tuple[float, float, float]
Spatial = tuple[Vector, Vector]  # of a motion or a force: linear and angular part
Symmetric = tuple[float, float, float, float, float, float]  # xx, xy, xz, yy, yz, zz
Inertia = tuple[float, Vector, Symmetric]  # mass, mass · centre, moments about the trunk's origin


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
