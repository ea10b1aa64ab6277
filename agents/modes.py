"""What the robot is doing and why: the modes, their order, and the named reasons to leave them.

stand → walk → stopping → stand; damping and estop are latched from anywhere. A robot that has been
led down, or that the operator has released from one of these, begins anew: rising → stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from quadriga.shared.codes import code_of
from quadriga.shared.runtime.record import record

STAND: Final = "stand"
WALK: Final = "walk"
STOPPING: Final = "stopping"
RISING: Final = "rising"  # in place, after it has been down
DAMPING: Final = "damping"
ESTOP: Final = "estop"

# Reasons for a safe stop that are losses of inputs, as a mode's reason begins.
REFERENCE_LOST: Final = "reference-lost"  # the operator is silent
WINDOW_LOST: Final = "window-lost"  # no plan of its own for as long as a peer may be silent
PEER_LOST: Final = "peer-lost"  # no plan of a peer for that long
PLANNER_LOST: Final = "planner-lost"  # no plan came for as long as a team waits for one
LED_DOWN: Final = "led-down"  # its motors had no commands: the agent was away, or cut off
IMU_LOST: Final = "imu-lost"  # its attitude is not known
ENCODER_LOST: Final = "encoder-lost"  # the angle of a joint is not known
LOSSES: Final = frozenset(
    (REFERENCE_LOST, WINDOW_LOST, PEER_LOST, PLANNER_LOST, LED_DOWN, IMU_LOST, ENCODER_LOST)
)

# Reasons for which a robot stands because somebody has said so, and walks only when told to.
STOPPED: Final = "stopped"  # somebody has asked the team to stop
RESET: Final = "reset"  # the operator has released the emergency stop
COMMANDED: Final = frozenset((STOPPED, RESET))

# Reasons for which a robot is damped, until the operator releases it.
NO_ESTIMATE: Final = "no-estimate"  # the orientation is not a number
FALL: Final = "fall"  # the trunk is tilted beyond `controller.fall_tilt`
NOT_UP: Final = "not-up"  # it got up, and does not stand

PRECEDENCE: Final = (ESTOP, DAMPING, STOPPING)  # of the stops of one tick, the gravest first
REASON_MOST: Final = 200  # characters of a reason; beyond 4096 no status could be read
SLOW_DOWN_MS: Final = 500  # of a safe stop: speed goes to zero while the trot goes on


@record
class Mode:
    """The present mode, since when, and the reason if it is not the normal course."""

    name: str
    since: int
    reason: str = ""

    @property
    def passive(self) -> bool:
        """Whether the joints are only damped."""
        return self.name in (DAMPING, ESTOP)

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


def step_mode(mode: Mode, tick: int, stand_ms: int, half_cycle_ends: bool) -> Mode:
    """The mode's normal course: start walking, finish a safe stop at the end of a stance."""
    if mode.name == STAND and not mode.reason and tick >= stand_ms:
        return Mode(WALK, tick)
    if mode.name == STOPPING and half_cycle_ends and tick - mode.since >= SLOW_DOWN_MS:
        return replace(mode, name=STAND)
    return mode


def resolve_stops(mode: Mode, tick: int, stops: Sequence[Stop]) -> Mode:
    """The mode after all stops of one tick: the gravest counts, of equally grave ones the first.

    Args:
        mode: of the normal course, see `step_mode`.
        tick: the present one.
        stops: in the order in which they came up.
    """
    if not stops:
        return mode
    gravest = min(stops, key=lambda stop: PRECEDENCE.index(stop.mode))
    if gravest.mode == STOPPING:
        return stop_safely(mode, tick, gravest.reason)
    return enter_passive(mode, tick, gravest.mode, gravest.reason)


def rests(mode: Mode) -> bool:
    """Whether a robot stands, slows down or gets up, and may walk again later."""
    return mode.name in (STAND, STOPPING, RISING) and code_of(mode.reason) in LOSSES | COMMANDED


def is_commanded(reason: str) -> bool:
    """Whether a robot stopped, or is damped, because somebody has said so."""
    return code_of(reason) in COMMANDED | {ESTOP}


def stop_safely(mode: Mode, tick: int, reason: str) -> Mode:
    """Slow down and stand, unless something graver is in force already.

    What somebody has asked for takes the place of a loss: a robot goes on by itself after none.
    """
    reason = reason[:REASON_MOST]
    if mode.name == WALK:
        return Mode(STOPPING, tick, reason)
    if mode.name == STAND and not mode.reason:
        return Mode(STAND, tick, reason)
    if rests(mode) and code_of(mode.reason) in LOSSES and code_of(reason) in COMMANDED:
        return replace(mode, reason=reason)
    return mode


def enter_passive(mode: Mode, tick: int, name: str, reason: str) -> Mode:
    """Damp the joints; an emergency stop outranks a fault, the first reason stays.

    Of a long reason, which anyone may send, the first `REASON_MOST` characters are kept.
    """
    if mode.name == ESTOP or (mode.passive and name == DAMPING):
        return mode
    return Mode(name, tick, reason[:REASON_MOST])
