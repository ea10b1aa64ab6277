"""The QP of forces within each foot's limits, by Newton's method on the faces of these limits.

    min_v ½ vᵀ H v + fᵀ v,   |v_x|, |v_y| ≤ min(box, c (n + v_z)),   low ≤ v_z ≤ high   (each foot)

Let P project each foot's force onto its limits in the metric of S⁻¹, S a share of the diagonal of
H⁻¹. Then v is optimal if and only if v = P(v − S (H v + f)). Newton's method on this equation
projects, takes the faces that the projected forces are on as active, solves the QP on these, and
projects again: a primal-dual active set (Hintermüller, Ito and Kunisch, SIAM J. Optim. 13, 2002).
It changes any number of bounds at once and ends after a few solutions, where a dual active set
adds one at a time. It may also cycle; then it gives up.

On its face a foot's force is v = T w with some of w fixed: w_z = v_z, w_x = v_x − c_x v_z, where
c_x is ±c on a side of the pyramid and 0 elsewhere, and the same for y.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.qp import Residuals, is_optimal, largest_residuals
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.jit import compiled

_MOST: Final = 12  # solutions on faces; a cycle ends here
# S over the diagonal of H⁻¹. With 0.5 to 0.7 none of 813 plans at limits cycled, of teams of 1 to 5
# that were pushed by 150 to 350 N; with 1.0 there were 12 that did, with 0.3 132. On other seeds,
# with 0.7, it was one of 3686; the others took 1 to 8 solutions, mostly 3 or 4.
_STEP: Final = 0.7
_CLOSE: Final = 1e-9  # N, of v from its projection: optimal but for rounding
FAILED: Final = -1  # instead of the number of solutions


class ForceQp(NamedTuple):
    """A QP of which only f changes.

    Attributes:
        H: shape (nv, nv), three forces for each foot; positive definite.
        minus_inverse: −H⁻¹.
        lower, upper: bounds of [v; A v], (nv + 4 nv / 3,): the box, then c n for the four sides of
            each foot's pyramid, which no lower bound holds.
        slope: c, positive.
        exact: bound of the stationarity of −H⁻¹ f for every f.
    """

    H: Array
    minus_inverse: Array
    lower: Array
    upper: Array
    slope: float
    exact: float


class _Faces(NamedTuple):
    """Where each foot's force is. Arrays of shape (nv,), in the order of the forces.

    Attributes:
        tilt: ±c for an x or y on a side of the pyramid, else 0.
        fixed: whether w is.
        value: of a w that is fixed.
    """

    tilt: Array
    fixed: NDArray[np.bool_]
    value: Array


class Minimum(NamedTuple):
    """A minimiser and its proof.

    Attributes:
        v: forces, (nv,), N.
        multipliers: of [v; A v], positive for upper bounds.
        residuals: of −H⁻¹ f a bound of them.
        solutions: how many QPs on faces it took, 0 of −H⁻¹ f; `FAILED`: no minimiser was found.
    """

    v: Array
    multipliers: Array
    residuals: Residuals
    solutions: int


@compiled
def minimise(qp: ForceQp, f: Array) -> Minimum:
    """The minimiser for f, (nv,): −H⁻¹ f if that keeps the limits, else by Newton's method."""
    # Unpacked before the loops: each access to a tuple in a loop costs a reference count.
    H, minus_inverse, lower, upper, slope, exact = qp
    nv = len(f)
    free = minus_inverse @ f
    inside = True
    for i in range(nv):
        inside = inside and lower[i] <= free[i] <= upper[i]
    for foot in range(nv // 3):
        limit = upper[nv + 4 * foot] + slope * free[3 * foot + 2]
        inside = inside and abs(free[3 * foot]) <= limit and abs(free[3 * foot + 1]) <= limit
    nothing = np.zeros(len(upper))
    if inside:
        return Minimum(free, nothing, Residuals(exact, 0.0, 0.0), 0)
    solutions = _MOST if np.isfinite(np.dot(f, f)) else 0
    metric = -_STEP * np.diag(minus_inverse)
    faces = _Faces(np.zeros(nv), np.zeros(nv, dtype=np.bool_), np.zeros(nv))
    v, gradient = free, np.zeros(nv)
    for solution in range(solutions):
        off = _project(v, gradient, metric, qp, faces)
        if off <= _CLOSE:
            found = _with_proof(qp, f, v, faces, solution)
            if is_optimal(found.residuals):
                return found
            break
        count = int(np.count_nonzero(faces.fixed))
        if 2 * count <= nv:
            v, gradient = _pull_back(minus_inverse, free, faces, count)
        else:
            v, gradient = _move_along(H, f, faces, nv - count)
        if not np.isfinite(v.sum()):
            break
    return Minimum(np.zeros(nv), nothing, Residuals(np.inf, np.inf, np.inf), FAILED)


@compiled
def _project(v: Array, gradient: Array, metric: Array, qp: ForceQp, faces: _Faces) -> float:
    """Fill the faces of P(v − S gradient); the largest distance of v from it, N."""
    (tilt, fixed, value), (_, _, lower, upper, slope, _) = faces, qp
    off, nv = 0.0, len(v)
    for i in range(0, nv, 3):
        x = v[i] - metric[i] * gradient[i]
        y = v[i + 1] - metric[i + 1] * gradient[i + 1]
        z = v[i + 2] - metric[i + 2] * gradient[i + 2]
        side = upper[nv + 4 * (i // 3)]
        height, held = _height(
            (abs(x), abs(y), z),
            (upper[i], upper[i + 1], lower[i + 2], upper[i + 2]),
            (metric[i + 2] / metric[i], metric[i + 2] / metric[i + 1]),
            side,
            slope,
        )
        fixed[i + 2], value[i + 2] = held, height
        off = max(off, abs(height - v[i + 2]))
        reach = side + slope * height
        for j, wanted in ((i, x), (i + 1, y)):
            limit = min(upper[j], reach)
            sign = 1.0 if wanted > 0.0 else -1.0
            fixed[j] = abs(wanted) > limit
            tilt[j] = sign * slope if fixed[j] and reach < upper[j] else 0.0
            value[j] = sign * (side if reach < upper[j] else upper[j])
            off = max(off, abs((sign * limit if fixed[j] else wanted) - v[j]))
    return off


@compiled
def _height(
    wanted: tuple[float, float, float],
    box: tuple[float, float, float, float],
    ratio: tuple[float, float],
    side: float,
    slope: float,
) -> tuple[float, bool]:
    """v_z of the projection of a foot's force, and whether it is held there.

    It minimises (v_z − z)² + Σ ratio (distance of |x|, |y| from the limit at v_z)²: an x beyond the
    pyramid pulls v_z up, until the pyramid reaches it or, at the latest, the box.

    Args:
        wanted: |x|, |y|, z, N.
        box: the largest x and y, the least and the largest v_z, N.
        ratio: of the metric of z to that of x and to that of y.
        side: c n, the pyramid's limit at v_z = 0.
        slope: c.
    """
    x, y, z = wanted
    x_most, y_most, low, high = box
    begin = min(max(z, low), high)
    if x <= min(x_most, side + slope * begin) and y <= min(y_most, side + slope * begin):
        return begin, begin != z
    x_end, y_end = (min(x, x_most) - side) / slope, (min(y, y_most) - side) / slope
    begin = low
    for end in (min(x_end, y_end), max(x_end, y_end), high):
        end = min(end, high)
        if end > begin:
            pull, stiffness = z, 1.0
            if x_end >= end:
                pull += ratio[0] * slope * (x - side)
                stiffness += ratio[0] * slope * slope
            if y_end >= end:
                pull += ratio[1] * slope * (y - side)
                stiffness += ratio[1] * slope * slope
            least = pull / stiffness
            if least <= begin:
                x_holds, y_holds = begin == x_end and x > x_most, begin == y_end and y > y_most
                return begin, begin == low or x_holds or y_holds
            if least < end:
                return least, False
            begin = end
    return high, True


@compiled
def _pull_back(minus_inverse: Array, free: Array, faces: _Faces, count: int) -> tuple[Array, Array]:
    """Forces and the gradient on faces with few fixed w: by what holds these."""
    tilt, fixed, value = faces
    nv = len(free)
    rows, places, off = np.zeros((count, 3)), np.empty(count, dtype=np.int64), np.empty(count)
    k = 0
    for i in range(nv):
        if fixed[i]:
            foot, axis = i - i % 3, i % 3
            places[k], rows[k, axis] = foot, -1.0
            off[k] = free[i] - value[i]
            if axis < 2:
                rows[k, 2] = tilt[i]
                off[k] -= tilt[i] * free[foot + 2]
            k += 1
    # The rows are the negative normals, and so is the inverse: their product is positive definite.
    gradient = _solve_on_rows(minus_inverse, rows, places, -1.0, off)
    return free - minus_inverse @ gradient, gradient


@compiled
def _move_along(H: Array, f: Array, faces: _Faces, count: int) -> tuple[Array, Array]:
    """Forces and the gradient on faces with few w that are not fixed: by moving these."""
    tilt, fixed, value = faces
    nv = len(f)
    rows, places, w = np.zeros((count, 3)), np.empty(count, dtype=np.int64), np.empty(count)
    v = np.zeros(nv)
    for i in range(0, nv, 3):
        height = value[i + 2] if fixed[i + 2] else 0.0
        v[i + 2] = height
        for j in (i, i + 1):
            v[j] = (value[j] if fixed[j] else 0.0) + tilt[j] * height
    gradient = f + H @ v
    k = 0
    for i in range(nv):
        if not fixed[i]:
            foot, axis = i - i % 3, i % 3
            places[k], rows[k, axis] = foot, 1.0
            w[k] = -gradient[i]
            if axis == 2:
                for j in range(2):
                    rows[k, j] = tilt[foot + j]
                    w[k] -= tilt[foot + j] * gradient[foot + j]
            k += 1
    moved = _solve_on_rows(H, rows, places, 1.0, w)
    return v + moved, gradient + H @ moved


@compiled
def _solve_on_rows(
    K: Array, rows: Array, places: NDArray[np.int64], sign: float, x: Array
) -> Array:
    """Rᵀ (sign · R K Rᵀ)⁻¹ x; row k of R has `rows[k]` from `places[k]` on. Replaces x."""
    count, row = len(places), np.empty(len(K))
    gram = np.zeros((count, count))
    for a in range(count):
        row[:] = 0.0
        for axis in range(3):
            if rows[a, axis] != 0.0:
                begin = places[a]
                _subtract(row[begin:], -sign * rows[a, axis], K[begin + axis, begin:])
        for b in range(a, count):
            at = places[b]
            gram[a, b] = rows[b, 0] * row[at] + rows[b, 1] * row[at + 1] + rows[b, 2] * row[at + 2]
    _solve(gram, x)
    out = np.zeros(len(K))
    for k in range(count):
        for axis in range(3):
            out[places[k] + axis] += rows[k, axis] * x[k]
    return out


@compiled
def _with_proof(qp: ForceQp, f: Array, v: Array, faces: _Faces, solutions: int) -> Minimum:
    """The minimiser v on its faces with the multipliers that hold it there, and their residuals."""
    (H, _, lower, upper, slope, _), (tilt, fixed, value) = qp, faces
    nv, Hv = len(f), H @ v
    multipliers, pull, values = np.zeros(len(upper)), np.zeros(nv), np.empty(len(upper))
    values[:nv] = v
    for i in range(0, nv, 3):
        row = nv + 4 * (i // 3)
        height, reach = value[i + 2], upper[row] + slope * value[i + 2]
        # Held where the pyramid reaches the box: its sides bear what z asks for, the box the rest.
        jump = fixed[i + 2] and lower[i + 2] < height < upper[i + 2]
        x, y, z = -(Hv[i] + f[i]), -(Hv[i + 1] + f[i + 1]), -(Hv[i + 2] + f[i + 2])
        x_jumps = jump and fixed[i] and abs(reach - upper[i]) <= _CLOSE
        y_jumps = jump and fixed[i + 1] and abs(reach - upper[i + 1]) <= _CLOSE
        x_side = abs(x) if tilt[i] != 0.0 and not x_jumps else 0.0
        y_side = abs(y) if tilt[i + 1] != 0.0 and not y_jumps else 0.0
        z += slope * (x_side + y_side)
        if x_jumps:
            x_side = min(abs(x), max(0.0, -z / slope))
            z += slope * x_side
        if y_jumps:
            y_side = min(abs(y), max(0.0, -z / slope))
        if fixed[i + 2] and not jump:
            multipliers[i + 2] = z
        for axis, force, side in ((0, x, x_side), (1, y, y_side)):
            sign = 1.0 if force > 0.0 else -1.0
            if fixed[i + axis]:
                multipliers[i + axis] = force - sign * side
            multipliers[row + 2 * axis + (force < 0.0)] = side
            pull[i + axis] = sign * side
            pull[i + 2] -= slope * side
            values[row + 2 * axis] = v[i + axis] - slope * v[i + 2]
            values[row + 2 * axis + 1] = -v[i + axis] - slope * v[i + 2]
    proof = largest_residuals(Hv, f, pull, values, multipliers, lower, upper)
    return Minimum(v, multipliers, proof, solutions)


@compiled
def _solve(S: Array, x: Array) -> None:
    """Replace x, (k,), by S⁻¹ x, and the upper triangle of S, (k, k), by its factor U, S = Uᵀ U.

    NaN where S is not positive definite. Whole rows are added up, several elements at a time, in
    an order that no processor changes.
    """
    count = len(x)
    for b in range(count):
        row = S[b, b:]
        fours = b - b % 4
        for a in range(0, fours, 4):  # the row is loaded and stored once for four
            row0, row1, row2, row3 = S[a, b:], S[a + 1, b:], S[a + 2, b:], S[a + 3, b:]
            s0, s1, s2, s3 = row0[0], row1[0], row2[0], row3[0]
            for j in range(len(row)):
                row[j] -= s0 * row0[j] + s1 * row1[j] + s2 * row2[j] + s3 * row3[j]
        for a in range(fours, b):
            _subtract(row, S[a, b], S[a, b:])
        pivot = np.sqrt(row[0]) if row[0] > 0.0 else np.nan
        for j in range(len(row)):
            row[j] /= pivot
        x[b] /= pivot
        _subtract(x[b + 1 :], x[b], row[1:])
    for b in range(count - 1, -1, -1):
        rest, row = x[b + 1 :], S[b, b + 1 :]
        total = x[b]
        for j in range(len(rest)):
            total -= row[j] * rest[j]
        x[b] = total / S[b, b]


@compiled
def _subtract(row: Array, factor: float, other: Array) -> None:
    """Subtract factor · other. Shapes (k,)."""
    for j in range(len(row)):
        row[j] -= factor * other[j]
