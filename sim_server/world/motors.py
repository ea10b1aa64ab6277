"""Motors and joints: from commands, as they arrive, to the torques that act on the joints.

A motor evaluates its command every tick at the joint's angle and rate of that tick. Its torque
follows what is asked for as a first-order lag and stays within what speed and temperature leave of
it; the joint's friction is then taken off:

    τ* = τ_ff + k_p (q_des − q) + k_d (q̇_des − q̇)          of the command sent `delay_ms` before
    τ ← τ + (1 − e^(−2π f Δt)) (τ* − τ),  |τ| ≤ limit        f: the bandwidth
    τ_joint = τ − c tanh(q̇ / v₀) − b q̇                       c, b: dry and viscous friction

Where torque and rate point the same way the limit is the driving torque up to the corner speed and
falls linearly to zero at the joint's speed limit, as in Unitree's torque-speed curves; a motor that
stands or brakes has its peak torque. Losses in the winding heat it: h' = ((τ/τ_c)² − h) / T, where
h = 1 is the temperature that the continuous torque τ_c reaches in the end. Above h = 0.8 the limit
falls, to τ_c at h = 1.
Friction has the shape of Unitree's actuator models; its size lies between that of the Go1's URDF
(0.2 N·m, 0.01 N·m·s/rad) and of the G1's motor of like torque, N5020-16 (0.6, 0.06;
unitree_rl_lab). Bandwidth and delay are those of good drives on a serial bus at 500 to 1000 Hz;
no source states Unitree's.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np

from quadriga.shared.config.sections import MotorsConfig
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import N_JOINTS, N_LEGS, Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.robots.torque_speed import MotorCurves, motor_curves, torque_range
from quadriga.shared.runtime.jit import compiled
from quadriga.sim_server.world.layout import JOINT_POSITIONS, JOINT_RATES

_TICK: Final = 1e-3  # s
_WARM: Final = 0.8  # of the temperature that continuous torque reaches: from here on torque falls
_CREEP: Final = 0.05  # rad/s, v₀: a joint slower than this may be kept still by dry friction
# Where a command's row has its fields.
_TAU, _Q_DES, _V_DES, _KP, _KD = (
    Command.CUTS[name] for name in ("tau", "q_des", "v_des", "kp", "kd")
)


class Motors:
    """The motors of all robots of a world.

    Attributes:
        torque: what they gave in the last tick, as their currents tell it, (n, 12), N·m.
        joint_torque: what of it was left for the joints, (n, 12), N·m.
        heat: temperature above the surroundings, 1 where the continuous torque leads, (n, 12).
    """

    def __init__(self, robot: RobotSpec, config: MotorsConfig, robots: int, idle: Command) -> None:
        """Cool motors that have got the command `idle` so far."""
        self._memory = np.zeros((4, robots, N_JOINTS))
        self.torque, self.joint_torque, self.heat, _ = self._memory
        lag = 1.0 - math.exp(-2.0 * math.pi * config.bandwidth * _TICK)
        # Of each joint the limits of a cool motor, `MotorCurves`, and that of a hot one, N·m.
        hot = np.tile(robot.continuous_torque, N_LEGS)
        self._limits = np.array([*motor_curves(robot, torque_speed=config.torque_speed), hot])
        # Share of a torque error that is made up for in a tick; friction, dry, N·m, and by rate,
        # N·m·s/rad; share of a tick in the filter of the temperature, 0: it stays.
        follow = lag if config.bandwidth > 0.0 else 1.0
        heating = _TICK / config.heat_time if config.heat_time > 0.0 else 0.0
        self._shares = follow, config.friction, config.viscous_friction, heating
        on_the_way = [np.tile(idle.row, (robots, 1)) for _ in range(config.delay_ms)]
        self._on_the_way: deque[Array] = deque(on_the_way)

    def send(self, rows: Array) -> Array:
        """Send rows of `Command`s, one of each robot, (n, 60); those that arrive now, likewise."""
        self._on_the_way.append(rows)
        return self._on_the_way.popleft()

    def drive(self, arrived: Array, q: Array, v: Array, strength: Array) -> None:
        """Let a tick pass under commands that have arrived.

        Args:
            arrived: rows of the robots' `Command`s, (n, 60).
            q: coordinates of each robot, its joints behind the trunk's seven, (n, 19).
            v: velocities, its joints behind the trunk's six, (n, 18).
            strength: the share of its limited torque that each motor gives, (n, 12).
        """
        _drive(arrived, q, v, strength, self._limits, self._shares, self._memory)


@compiled
def _drive(
    commands: Array,
    q: Array,
    v: Array,
    strength: Array,
    limits: Array,
    shares: tuple[float, float, float, float],
    memory: Array,
) -> None:
    """Advance torques, what of them is left for the joints, heat and what sound motors give."""
    curves, hot = MotorCurves(limits[0], limits[1], limits[2], limits[3]), limits[4]
    follow, dry, viscous, heating = shares
    torque, left, heat, sound = memory[0], memory[1], memory[2], memory[3]
    for i in range(len(commands)):
        row, angles, rates = commands[i], q[i, JOINT_POSITIONS], v[i, JOINT_RATES]
        tau_ff, q_des, v_des = row[_TAU], row[_Q_DES], row[_V_DES]
        kp, kd = row[_KP], row[_KD]
        for k in range(N_JOINTS):
            wanted = kp[k] * (q_des[k] - angles[k])
            wanted += kd[k] * (v_des[k] - rates[k])
            wanted += tau_ff[k]
            lower, upper = torque_range(rates[k], curves, k)
            if heating > 0.0:
                # Heat limits the current, speed the voltage: the lower limit holds.
                peak, continuous = curves.peak[k], hot[k]
                cool = min(1.0, max(0.0, (1.0 - heat[i, k]) / (1.0 - _WARM)))
                limit = continuous + cool * (peak - continuous)
                lower, upper = max(lower, -limit), min(upper, limit)
            wanted = min(max(wanted, lower), upper)
            if follow < 1.0:
                wanted = sound[i, k] + follow * (wanted - sound[i, k])
            sound[i, k] = min(max(wanted, lower), upper)
            torque[i, k] = strength[i, k] * sound[i, k]
            loss = (torque[i, k] / hot[k]) ** 2
            heat[i, k] += heating * (loss - heat[i, k])
            left[i, k] = torque[i, k]
            if dry > 0.0 or viscous > 0.0:
                left[i, k] -= dry * math.tanh(rates[k] / _CREEP) + viscous * rates[k]
