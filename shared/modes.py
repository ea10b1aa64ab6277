"""What a robot does, and how one mode becomes another: for agents, bridges and simulated worlds.

              stand up                 start                stop
    PASSIVE ──────────► STANDING_UP ──► STAND ──────► WALK ──────► STOPPING
       ▲  ▲     reset ▲                │  ▲ ▲           │              │
       │  │     ESTOP ┘                │  │ └───────────┼──────────────┘ at the end of a stance
       │  └─────────── LYING_DOWN ◄────┘  └─────────────┘ a sensor is lost
       └── from anywhere, for a fault: damped, until the operator's reset; likewise ESTOP

Agents stand up after a reset alone, bridges before each walk. A bridge lets its robot lie down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from quadriga.shared.codes import code_of
from quadriga.shared.runtime.record import record

PASSIVE: Final = "passive"  # joints damped, or motors off; with a reason it is latched
STANDING_UP: Final = "standing-up"
STAND: Final = "stand"
WALK: Final = "walk"
STOPPING: Final = "stopping"  # the trot goes on, slower and slower
LYING_DOWN: Final = "lying-down"
ESTOP: Final = "estop"  # the emergency stop: damped, latched

# Reasons to stop that are losses of inputs, as a mode's reason begins.
REFERENCE_LOST: Final = "reference-lost"  # the operator is silent
WINDOW_LOST: Final = "window-lost"  # no plan of its own for as long as a peer may be silent
PEER_LOST: Final = "peer-lost"  # a peer is silent, or does not walk
PLANNER_LOST: Final = "planner-lost"  # no plan came for as long as a team waits for one
IMU_LOST: Final = "imu-lost"  # its attitude is not known
ENCODER_LOST: Final = "encoder-lost"  # the angle of a joint is not known
LOSSES: Final = frozenset(
    (REFERENCE_LOST, WINDOW_LOST, PEER_LOST, PLANNER_LOST, IMU_LOST, ENCODER_LOST)
)

# Reasons for which a robot stands because somebody has asked for it.
STOPPED: Final = "stopped"  # somebody has asked the team to stop
RESET: Final = "reset"  # the operator has released the emergency stop
COMMANDED: Final = frozenset((STOPPED, RESET))

# Reasons for which a robot is passive, until the operator releases it.
NO_ESTIMATE: Final = "no-estimate"  # the orientation is not a number
FALL: Final = "fall"  # the trunk is tilted beyond `controller.fall_tilt`
NOT_UP: Final = "not-up"  # it stood up, and does not stand

PRECEDENCE: Final = (ESTOP, PASSIVE, STAND, STOPPING)  # of the stops of one tick, gravest first
REASON_MOST: Final = 200  # characters of a reason; beyond 4096 no status could be read
SLOW_DOWN_MS: Final = 500  # of a stop: speed goes to zero while the trot goes on


@record
class Mode:
    """The present mode, since when, and the reason if it is not the normal course."""

    name: str
    since: int
    reason: str = ""

    @property
    def passive(self) -> bool:
        """Whether the joints are only damped."""
        return self.name in (PASSIVE, ESTOP)

    @property
    def may_resume(self) -> bool:
        """Whether the robot stands, slows down or stands up, and may walk again later."""
        code = code_of(self.reason)
        return self.name in (STAND, STOPPING, STANDING_UP) and code in LOSSES | COMMANDED

    def speed_factor(self, tick: int) -> float:
        """Share of the commanded speed that is still followed."""
        if self.name == WALK:
            return 1.0
        if self.name == STOPPING:
            return max(0.0, 1.0 - (tick - self.since) / SLOW_DOWN_MS)
        return 0.0


@record
class Stop:
    """A cause to leave the normal course: the mode it asks for (of `PRECEDENCE`) and why."""

    mode: str
    reason: str


def next_mode(mode: Mode, tick: int, stand_ms: int, stance_ends: bool) -> Mode:
    """The mode's normal course: start walking, finish a stop at the end of a stance."""
    if mode.name == STAND and not mode.reason and tick >= stand_ms:
        return Mode(WALK, tick)
    if mode.name == STOPPING and stance_ends and tick - mode.since >= SLOW_DOWN_MS:
        return replace(mode, name=STAND)
    return mode


def resolve_stops(mode: Mode, tick: int, stops: Sequence[Stop]) -> Mode:
    """The mode after all stops of one tick: the gravest counts, of equally grave ones the first.

    An emergency stop outranks a fault, and the first reason of either stays. What somebody has
    asked for takes the place of a loss, after which a robot may go on by itself.

    The mode is that of the normal course, see `next_mode`; stops are in the order in which they
    came up.
    """
    if not stops:
        return mode
    stop = min(stops, key=lambda stop: PRECEDENCE.index(stop.mode))
    if stop.mode in (ESTOP, PASSIVE):
        keeps = mode.name == ESTOP or (mode.passive and stop.mode == PASSIVE)
        return mode if keeps else Mode(stop.mode, tick, stop.reason[:REASON_MOST])
    commanded = (other.reason for other in stops if code_of(other.reason) in COMMANDED)
    reason = next(commanded, stop.reason)[:REASON_MOST]
    if mode.name == WALK or (mode.name == STOPPING and stop.mode == STAND):
        return Mode(stop.mode, tick, reason)
    if mode.name == STAND and not mode.reason:
        return Mode(STAND, tick, reason)
    if mode.may_resume and code_of(mode.reason) in LOSSES and code_of(reason) in COMMANDED:
        return replace(mode, reason=reason)
    return mode


def is_commanded(reason: str) -> bool:
    """Whether a robot stopped, or is damped, because somebody has asked for it."""
    return code_of(reason) in COMMANDED | {ESTOP}
