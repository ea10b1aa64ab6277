"""What a robot senses of itself at a tick, as one flat row that the second half of a tick takes."""

from __future__ import annotations

from typing import Final, NamedTuple

from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.agents.controller.memory import Memory
from quadriga.shared.robots.conventions import N_JOINTS, N_LEGS, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record


class SensedLayout(NamedTuple):
    """Where `Sensed.flat` keeps what; the first three are Pinocchio's q, the next three its v.

    Attributes:
        position: of the trunk's origin, (3,), m, odometry frame.
        quat_xyzw: the trunk's attitude, normalised, (4,).
        q_joint: joint angles, (12,), rad.
        v_trunk: velocity of the trunk's origin, (3,), m/s, trunk frame.
        omega: angular velocity, (3,), rad/s, trunk frame.
        v_joint: joint rates, (12,), rad/s.
        R: trunk to odometry frame, (3, 3).
        p_foot: foot centres, (4, 3), m, odometry frame.
        velocity: of the trunk's origin, (3,), m/s, odometry frame.
        outputs: the planner's y, (6,), see `outputs_at`.
        switched: 1 if stances and swings have just ended.
        foot_load: vertical forces of the ground on the feet, (4,), N.
    """

    position: slice
    quat_xyzw: slice
    q_joint: slice
    v_trunk: slice
    omega: slice
    v_joint: slice
    R: slice
    p_foot: slice
    velocity: slice
    outputs: slice
    switched: int
    foot_load: slice


SENSED: Final = SensedLayout(
    **places(
        position=3,
        quat_xyzw=4,
        q_joint=N_JOINTS,
        v_trunk=3,
        omega=3,
        v_joint=N_JOINTS,
        R=3 * 3,
        p_foot=N_LEGS * 3,
        velocity=3,
        outputs=N_OUTPUTS,
        switched=1,
        foot_load=N_LEGS,
    )
)
SENSED_SIZE: Final = row_size(SENSED)
_Q: Final = slice(SENSED.position.start, SENSED.q_joint.stop)
_V: Final = slice(SENSED.v_trunk.start, SENSED.v_joint.stop)
_UPRIGHT: Final = SENSED.R.stop - 1  # R_zz


class TrunkState(NamedTuple):
    """Where the trunk is and how it moves.

    Attributes:
        position: of its origin, (3,), m, odometry frame.
        velocity: of its origin, (3,), m/s, odometry frame.
        R: trunk to odometry frame, (3, 3).
        omega: angular velocity, (3,), rad/s, trunk frame.
    """

    position: Array
    velocity: Array
    R: Array
    omega: Array


class FeetState(NamedTuple):
    """Where the feet are, how they move and what they bear.

    Attributes:
        position: of their centres, (4, 3), m, odometry frame.
        velocity: of their centres, (4, 3), m/s, odometry frame.
        force: vertical forces of the ground on them, (4,), N.
        ground_force: forces of the ground by the joints' torques, (4, 3), N, odometry frame;
            zero where only foot sensors tell what feet bear.
    """

    position: Array
    velocity: Array
    force: Array
    ground_force: Array


@compiled
def coordinates_of(flat: Array) -> tuple[Array, Array]:
    """Views of Pinocchio's q, (19,), and v, (18,)."""
    return flat[_Q], flat[_V]


@compiled
def trunk_of(flat: Array) -> TrunkState:
    """Views of the trunk's state."""
    return TrunkState(
        flat[SENSED.position],
        flat[SENSED.velocity],
        flat[SENSED.R].reshape(3, 3),
        flat[SENSED.omega],
    )


@compiled
def feet_of(flat: Array) -> Array:
    """View of the foot centres, (4, 3), m, odometry frame."""
    return flat[SENSED.p_foot].reshape(4, 3)


@record
class Sensed:
    """What a robot senses of itself at one tick.

    Attributes:
        memory: the low level's memory, its estimator and contacts advanced to this tick.
        flat: the rest, see `SensedLayout`; not to be changed.
    """

    memory: Memory
    flat: Array

    @property
    def q(self) -> Array:
        """Pinocchio's configuration, (19,)."""
        return self.flat[_Q]

    @property
    def v(self) -> Array:
        """Pinocchio's velocity, (18,)."""
        return self.flat[_V]

    @property
    def outputs(self) -> Array:
        """The outputs y: z over the ground, vx, vy (yaw frame), roll, pitch, wz. (6,)."""
        return self.flat[SENSED.outputs]

    @property
    def upright(self) -> float:
        """Cosine of the angle between the trunk's z axis and the vertical."""
        return float(self.flat[_UPRIGHT])

    @property
    def R(self) -> Array:
        """Trunk to odometry frame, (3, 3)."""
        return self.flat[SENSED.R].reshape(3, 3)

    @property
    def p_foot(self) -> Array:
        """Foot centres, (4, 3), m, odometry frame."""
        return self.flat[SENSED.p_foot].reshape(4, 3)
