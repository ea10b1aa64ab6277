"""A simulated robot whose commands are lost is led down and then damped: that is no fall.

With two feet in the air and damped joints a robot collapses within 0.4 s. So its joints are led
from where they are to the posture in which it lies on folded legs, with limited torques. Then it
sinks on its belly, and from then on its joints are damped as those of any motor without a command.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np

from quadriga.plant.late import damp_joints
from quadriga.shared.config.sections import SIMULATED, Config
from quadriga.shared.messages import Command, State
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.motions import Motion, posture_at, way_down

LOWER: Final = "lower"  # of `world.lost_command`
_SECONDS: Final = 1.5  # from the stand to the ground
_SINK_S: Final = 1.0  # on folded legs, until the belly is on the ground
_SINKING: Final = 8.0  # N·m·s/rad, meanwhile
_SHARE: Final = 0.6  # of the motors' torque that may be asked for


class _Descent(NamedTuple):
    """Since when, and how, a robot is led down."""

    since: int
    motion: Motion


class LostCommands:
    """Stands in for commands that do not come; what it gives depends on its arguments alone.

    Args:
        config: the team's configuration.

    Attributes:
        lowered: robots without commands that are led down, or have been.
    """

    def __init__(self, config: Config) -> None:
        self._lowers = config.world.lost_command == LOWER and config.team.plant == SIMULATED
        self._robot, self._gains = config.robot, (config.bridge.stand_kp, config.bridge.stand_kd)
        self._limit = _SHARE * config.robot.torque_limit
        self._descents: dict[str, _Descent] = {}

    @property
    def lowered(self) -> frozenset[str]:
        return frozenset(self._descents)

    def fill(
        self,
        tick: int,
        names: tuple[str, ...],
        commands: Mapping[str, Command],
        states: Callable[[], Mapping[str, State]],
    ) -> Mapping[str, Command]:
        """The commands of a tick, with those that lead robots down which have none.

        Args:
            tick: the present one.
            names: of all robots.
            commands: by robot.
            states: gives what each robot measures at this tick.
        """
        if not self._lowers or (len(commands) == len(names) and not self._descents):
            return commands
        filled, measured = dict(commands), states()
        for name in names:
            if name in commands:
                self._descents.pop(name, None)
                continue
            if name not in self._descents:
                motion = way_down(measured[name].q_joint, self._robot, _SECONDS)
                self._descents[name] = _Descent(tick, motion)
            command = self._command(tick, self._descents[name], measured[name])
            if command is not None:
                filled[name] = command
        return filled

    def _command(self, tick: int, descent: _Descent, state: State) -> Command | None:
        """What leads a robot down at a tick; None once it is to be damped as any other."""
        seconds = 1e-3 * (tick - descent.since)
        if seconds < descent.motion.seconds:
            return self._lead(tick, *posture_at(descent.motion, seconds), state)
        if seconds < descent.motion.seconds + _SINK_S:
            return damp_joints(tick, _SINKING)
        return None

    def _lead(self, tick: int, q_des: Array, v_des: Array, state: State) -> Command:
        """The command that leads the joints through a posture, with limited torques."""
        kp, kd = self._gains
        tau = kp * (q_des - state.q_joint) + kd * (v_des - state.v_joint)
        limited = np.clip(tau, -self._limit, self._limit)
        return Command(tick, tick * 1_000_000, limited, *np.zeros((4, N_JOINTS)))
