"""Checks of what is planned and commanded: friction cone, swing legs, torques."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import horizon_stance
from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.recordings.checks.getting_up import Doubts, GettingUp
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, Plan
from quadriga.shared.robots.conventions import JOINT_NAMES, Array, Leg, robot_names
from quadriga.shared.robots.registry import ROBOTS

TOLERANCE: Final = 1e-6  # N and N·m


class Friction:
    """Every planned force lies in the friction cone, and a swing leg's is zero."""

    def __init__(self, config: Config) -> None:
        self.finding = Finding("friction", "plans")
        self._config = config
        self._indices = {name: i for i, name in enumerate(robot_names(config.team.robots))}
        self._worst = 0.0

    def look(self, item: CheckedMessage) -> None:
        plan = item.message
        if not isinstance(plan, Plan) or item.robot not in self._indices:
            return
        self.finding.looked += 1
        N = self._config.planner.N
        if len(plan.u) != N:
            self.finding.add_objection(
                plan.tick, item.key, f"{len(plan.u)} samples", f"{N} samples"
            )
            return
        stance = horizon_stance(self._config, self._indices[item.robot], plan.step)
        excess, limits = _excess(plan.u.reshape(N, 4, 3), stance, self._config)
        self._worst = max(self._worst, float(excess.max()))
        if excess.max() > TOLERANCE:
            sample, leg, axis = np.unravel_index(int(excess.argmax()), excess.shape)
            force = plan.u.reshape(N, 4, 3)[sample, leg, axis]
            self.finding.add_objection(
                plan.tick,
                item.key,
                f"f{'xyz'[axis]} {force:.6g} N of {Leg(int(leg)).name} at sample {sample}",
                limits[int(bool(stance[sample, leg])) * (1 + int(axis == 2))],
            )

    def finish(self) -> None:
        """Say how far the worst one is outside."""
        self.finding.notes.append(f"at most {max(self._worst, 0.0):.1e} N outside")


def _excess(
    forces: Array, stance: NDArray[np.bool_], config: Config
) -> tuple[Array, tuple[str, str, str]]:
    """How far each component is outside, N, shape (N, 4, 3); limits of swing, fx and fy, fz."""
    cone, least = config.planner.mu / math.sqrt(2.0), config.planner.force_min
    excess = np.abs(forces)
    standing = excess[..., :2] - cone * forces[..., 2:]
    excess[..., :2] = np.where(stance[..., None], standing, excess[..., :2])
    excess[..., 2] = np.where(stance, least - forces[..., 2], excess[..., 2])
    return excess, ("0 of a swing leg", f"{cone:.4g} · fz", f"at least {least:g} N")


class Torques:
    """No commanded torque exceeds what the motor gives, and no gain adds more than damping.

    A robot that gets up is led there by stiff joints, with gains of its bridge's stand. A
    controller of one's own may have any gains that the plant takes.
    """

    def __init__(self, config: Config, getting_up: GettingUp) -> None:
        self.finding = Finding("torques", "commands")
        self._doubts = Doubts(self.finding, getting_up)
        self._stand = config.bridge.stand_kp, config.bridge.stand_kd
        self._damping = config.controller.damping
        self._limit = np.full(len(JOINT_NAMES), np.inf)
        if config.team.robot in ROBOTS:
            self._limit = config.robot.torque_limit
        else:
            self.finding.notes.append(f"limits of {config.team.robot!r} are not known here")
        self._any_gains = bool(config.team.agent_command)
        self._largest = 0.0

    def look(self, item: CheckedMessage) -> None:
        command = item.message
        if not isinstance(command, Command):
            return
        self.finding.looked += 1
        torque = np.abs(command.tau)
        self._largest = max(self._largest, float(torque.max()))
        k = int((torque - self._limit).argmax())
        if torque[k] > self._limit[k] + TOLERANCE:
            self.finding.add_objection(
                command.tick,
                item.key,
                f"{torque[k]:.6g} N·m of {JOINT_NAMES[k]}",
                f"{self._limit[k]:g} N·m",
            )
        if self._any_gains:
            return
        kp, kd = float(np.abs(command.kp).max()), float(command.kd.max())
        if kp > 0.0 or kd > self._damping or float(command.kd.min()) < 0.0:
            got = f"gains kp up to {kp:.6g}, kd up to {kd:.6g}"
            limit = f"no kp, kd from 0 to {self._damping:g}"
            if (kp, kd) == self._stand:
                self._doubts.add(item.robot, command.tick, command.tick, item.key, got, limit)
            else:
                self.finding.add_objection(command.tick, item.key, got, limit)

    def finish(self) -> None:
        """Say how large the largest is."""
        self._doubts.resolve()
        if self.finding.looked:
            self.finding.notes.append(f"at most {self._largest:.1f} N·m")
