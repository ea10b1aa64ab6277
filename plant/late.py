"""What a motor does when its robot's command is late: use it, hold the joints, damp them."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.config.sections import WorldConfig
from quadriga.shared.messages import Command, State
from quadriga.shared.robots.conventions import N_JOINTS

FRESH: Final = "fresh"
HOLD: Final = "hold"
DAMP: Final = "damp"

PROMPT_TICKS: Final = 10  # for which commands must be prompt after one was late
SURE_TICKS: Final = 100  # likewise, after commands were lost
MOST_HELD_MS: Final = 1000  # then late commands are as good as lost: yokes tip over who is held
MOTOR_DAMPING: Final = 2.0  # N·m·s/rad, damping of a motor without a command
_HOLD_KP: Final = 80.0  # N·m/rad, carries a standing robot
_HOLD_KD: Final = 3.0  # N·m·s/rad


def grade(age_ms: int, world: WorldConfig) -> str:
    """Which of the three applies to a command of this age."""
    if age_ms <= world.command_hold_ms:
        return FRESH
    return HOLD if age_ms <= world.command_damp_ms else DAMP


class Lateness:
    """What applies to one robot tick by tick: once late, its commands must be prompt again.

    Over a link that takes about as long as a command may be old, its age dithers about that limit.
    The motors would change to and fro between holding a posture and torques that belong to another
    one. So they hold until commands have been younger than half the limit for some ticks. A link
    that loses packets comes and goes: once commands were lost, they must be prompt for longer.

    Args:
        world: the limits.

    Attributes:
        late_ms: for how long the motors have not followed the commands; 0: they follow them.
    """

    def __init__(self, world: WorldConfig) -> None:
        self._world = world
        self._state = FRESH
        self._prompt = 0  # ticks in a row with a prompt command
        self.late_ms = 0

    def grade(self, age_ms: int) -> str:
        """Which of the three applies at the next tick, with a command of this age."""
        now = grade(age_ms, self._world)
        if now == HOLD and self.late_ms >= MOST_HELD_MS:
            now = DAMP
        if now == DAMP or (now == HOLD and self._state == FRESH):
            self._state = now
        is_prompt = 2 * age_ms <= self._world.command_hold_ms
        self._prompt = self._prompt + 1 if is_prompt else 0
        if self._prompt >= (SURE_TICKS if self._state == DAMP else PROMPT_TICKS):
            self._state = FRESH
        self.late_ms = 0 if self._state == FRESH else self.late_ms + 1
        return self._state


def hold_joints(state: State) -> Command:
    """The command that holds the joints where they are measured in `state`."""
    zero = np.zeros(N_JOINTS)
    kp, kd = np.full(N_JOINTS, _HOLD_KP), np.full(N_JOINTS, _HOLD_KD)
    return Command(state.tick, state.stamp_ns, zero, state.q_joint, zero, kp, kd)


def damp_joints(tick: int, damping: float = MOTOR_DAMPING) -> Command:
    """The command that damps all joints, by default as motors without a command are damped.

    Args:
        tick: of the command.
        damping: N·m·s/rad.
    """
    zero = np.zeros(N_JOINTS)
    return Command(tick, tick * 1_000_000, zero, zero, zero, zero, np.full(N_JOINTS, damping))
