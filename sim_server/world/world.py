"""The simulated world of a team: motors, physics, sensors, truth; one tick is 1 ms."""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import Final

import mujoco
import numpy as np

from quadriga.plant.commands import damp_joints
from quadriga.plant.protocol import Plant
from quadriga.shared.codes import FALL, FAULT_ASKED, LIES, UNSTABLE
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Command, Event, State, Truth
from quadriga.shared.robots.conventions import FOOT_FRAMES, N_JOINTS, N_LEGS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.sim_server.terrain.terrain import FOLLOW_MS
from quadriga.sim_server.world import layout
from quadriga.sim_server.world.faults import Injection, with_time
from quadriga.sim_server.world.motors import Motors
from quadriga.sim_server.world.scenario import build_scenario
from quadriga.sim_server.world.sensors import Sensors
from quadriga.sim_server.world.team_model import build_team_model

_FALL_COSINE: Final = math.cos(1.0)  # of the angle between the trunk's z axis and the vertical
_FALL_HEIGHT: Final = 0.12  # m, trunk origin above the mean terrain under the hips
_RISEN: Final = 0.06  # m, above that height a robot is up again that was stopped
_DAMPED: Final = damp_joints(0)
# Of positions, speeds or accelerations that are no numbers, or huge.
_UNSTABLE: Final = slice(mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQACC + 1)


def _warn(text: str) -> None:
    print(f"MuJoCo: {text}", file=sys.stderr, flush=True)


# By default MuJoCo leaves a file in the working directory.
mujoco.set_mju_user_warning(_warn)

_UP, _DOWN, _NO_NUMBERS = range(3)  # how trunks are, see `_look`


class World(Plant):
    """One MuJoCo world with the whole team; equal configurations and commands give equal bytes.

    A tick is split at the point where commands enter: `mj_step2` takes the commands of tick t to
    positions and velocities at t + 1, then `mj_step1` evaluates everything that depends on those
    alone. So what is published for t + 1 has positions and rates at t + 1, while specific force,
    contact forces and yoke forces are those that acted from t to t + 1, as a real sensor would
    measure them: the forces at t + 1 depend on a command not given yet. This costs as much as
    `mj_step`, and no sensor waits for `mj_step1`, which runs while the agents compute their
    commands. The forces of tick 0 are those of motors without torque.

    Attributes:
        motors: of all robots.

    Args:
        config: the team's configuration.
        names: the robots that are in this world, where robots have worlds of their own; by default
            all of the team.

    Raises:
        ConfigError: the payload, a push, a weak motor, a fault or `world.friction_of` names no
            robot or does not parse, the reference's trace is no trace, or the robot's URDF is
            missing.
    """

    def __init__(self, config: Config, names: Sequence[str] = ()) -> None:
        self.tick = 0
        self.team = build_team_model(config, names=names)
        self.names = tuple(self.team.robots)
        self._indices = list(self.team.robots.values())
        self.physics = mujoco.MjData(self.team.model)
        self._scenario = build_scenario(config, self.team.payload)
        self._injection = Injection(config, self.names)
        self._live_faults = config.world.live_faults
        self._events = defaultdict[int, list[Event]](list)
        for event in (*self._scenario.events, *self._injection.events):
            if event.robot in ("", *self.names):
                self._events[event.tick].append(event)
        n = len(self.names)
        # Views of MuJoCo's own memory; behind the robots come the terrain's bodies.
        self._q = self.physics.qpos[: n * layout.NQ].reshape(n, layout.NQ)
        self._v = self.physics.qvel[: n * layout.NV].reshape(n, layout.NV)
        applied = self.physics.qfrc_applied[: n * layout.NV].reshape(n, layout.NV)
        self._applied = applied[:, layout.JOINT_RATES]
        self._sensed = self.physics.sensordata.reshape(n, layout.N_SENSORS)
        self.motors = Motors(config.robot, config.motors, n, _DAMPED)
        self._strength = np.ones((n, N_JOINTS))
        self._feet_under_hips = config.robot.feet_under_hips
        self._down: tuple[str, ...] = ()  # names of those that have fallen
        self._stopped = frozenset[str]()  # names of those that an emergency stop damps
        self._excused = set[str]()  # with them, those that have not been up since
        self._lying = set[str]()  # of these, those that have gone to the ground
        self._surely_up = _FALL_HEIGHT + self.team.terrain.top
        # Compiled functions are compiled, or loaded, now and not in the first tick.
        Motors(config.robot, config.motors, n, _DAMPED).drive(
            np.zeros((n, len(_DAMPED.row))), self._q, self._v, self._strength
        )
        _look(self._q, _FALL_COSINE, self._surely_up)
        self._sensors = Sensors(config.sensors, config.world.seed, self._indices)

        self.physics.qpos[:] = self.team.q_spawn
        mujoco.mj_forward(self.team.model, self.physics)
        model = self.team.model
        feet = (f"{name}/{foot}" for name in self.names for foot in FOOT_FRAMES)
        self._feet = [model.geom(foot).id for foot in feet]
        radius = config.robot.geometry.foot_radius
        self._moving = self.team.terrain.start(model, self.physics, n, radius)
        self._settled, self._unstable = True, self.physics.warning.number[_UNSTABLE]
        self._yoke_force = self._read_yoke_force()
        self._states = self._measure()

    def states(self) -> dict[str, State]:
        """Every robot's sensor message of this tick; every call returns the same bytes."""
        return dict(self._states)

    def step(self, commands: Mapping[str, Command]) -> tuple[Event, ...]:
        """Advance by one tick under the motors' torques and return what happened.

        The motors follow the commands as `motors` tells, a weak one with its share of the torque.
        Those of a robot without a command damp its joints, see `quadriga.plant.commands`.
        """
        events = self._events.get(self.tick, ())
        if (forces := self._scenario.forces.get(self.tick)) is not None:
            self.physics.xfrc_applied[self.team.trunks, :3] = forces[self._indices]
        if (strength := self._scenario.strength.get(self.tick)) is not None:
            self._strength = strength[self._indices]
        rows = np.array([commands.get(name, _DAMPED).row for name in self.names])
        self._injection.distort(Command, self.tick, rows)
        self.motors.drive(self.motors.send(rows), self._q, self._v, self._strength)
        self._applied[:] = self.motors.joint_torque
        if not self._settled:  # and so nobody has asked for the truth of this tick
            self._evaluate()
        mujoco.mj_step2(self.team.model, self.physics)
        self._settled = False
        self.tick += 1
        self._states = self._measure()
        return (*events, *self._falls())

    def settle(self) -> None:
        """Evaluate what depends on this tick's positions and velocities, once per tick.

        The next step does it if nobody has. While the robots answer there is time for it.
        """
        if self._settled:
            return
        self._yoke_force = self._read_yoke_force()  # the rows of the next tick take their place
        self._evaluate()

    def _evaluate(self) -> None:
        if self._moving is not None and (self.tick - 1) % FOLLOW_MS == 0:
            self._moving.follow(self.physics.geom_xpos[self._feet])
        mujoco.mj_step1(self.team.model, self.physics)
        self._settled = True

    def truth(self) -> Truth:
        """The ground truth of this tick."""
        self.settle()
        rotation = self.physics.xmat[self.team.trunks].reshape(-1, 3, 3)
        return Truth(
            tick=self.tick,
            stamp_ns=self.tick * 1_000_000,
            robots=self.names,
            base_pos=self._q[:, layout.POSITION].copy(),
            base_quat_wxyz=self._q[:, layout.ATTITUDE].copy(),
            base_vel=self._v[:, layout.VELOCITY].copy(),
            base_omega=(rotation @ self._v[:, layout.TRUNK_RATE, None])[:, :, 0],
            # MuJoCo reports the force of the foot on the ground.
            grf=-self._sensed[:, layout.CONTACT_FORCES].reshape(-1, N_LEGS, 3),
            yoke_error=self.physics.ten_length - self.team.rest_length,
            yoke_force=self._yoke_force,
        )

    def inject(self, fault: str) -> tuple[Event, ...]:
        if not self._live_faults:
            expected = "world.live_faults = true when the walk begins"
            raise ConfigError("fault", f"{fault!r} in a world without", expected)
        return self.add_fault(with_time(fault, self.tick))

    def add_fault(self, fault: str) -> tuple[Event, ...]:
        """Add a fault as `world.faults` has it; what is announced of it now.

        Raises:
            ConfigError: it does not parse, or names what there is not.
        """
        added = self._injection.add(fault)
        for event in added:
            self._events[event.tick].append(event)
        return tuple(Event.of(self.tick, FAULT_ASKED, e.robot, fault) for e in added[:1])

    def fallen(self) -> tuple[str, ...]:
        """Robots that have fallen so far."""
        return self._down

    def expect_down(self, stopped: Collection[str]) -> None:
        self._stopped = frozenset(stopped)
        self._excused |= self._stopped

    def _measure(self) -> dict[str, State]:
        tick = self.tick
        rows = self._sensors.measure(tick, self._q, self._v, self.motors.torque, self._sensed)
        self._injection.distort(State, tick, rows)
        stamp_ns = tick * 1_000_000
        return {n: State.from_row(tick, stamp_ns, rows[i]) for i, n in enumerate(self.names)}

    def _read_yoke_force(self) -> Array:
        """Force of each yoke on its two robots, positive when it pushes them apart, N. Shape (k,).

        Equality constraints come first among the constraint rows, in the order of the model.
        """
        forces: Array = self.physics.efc_force[: len(self.team.yokes)].copy()
        return forces

    def _falls(self) -> list[Event]:
        """An event for each robot that fell in this tick; of an unstable simulation one for all."""
        events = list[Event]()
        how = _look(self._q, _FALL_COSINE, self._surely_up)
        if any(self._unstable.tolist()) or how == _NO_NUMBERS:
            if self._down != self.names:
                self._down = self.names
                detail = "unstable simulation: positions, speeds or accelerations are no numbers"
                events.append(Event.of(self.tick, UNSTABLE, "", f"{detail}, or huge"))
            return events
        if how == _UP and not self._excused:
            return events
        for i, (x, y, z, qw, qx, qy, qz) in enumerate(self._q[:, layout.POSE].tolist()):
            cosine = 1.0 - 2.0 * (qx * qx + qy * qy)
            if cosine >= _FALL_COSINE and z >= self._surely_up:
                if self._excused and z >= self._surely_up + _RISEN:
                    self._note_up(self.names[i])
                continue
            if (name := self.names[i]) in self._down:
                continue
            yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
            # The mean under the hips, since the trunk may be over a block between the feet.
            above = z - float(
                self.team.terrain.height_under_hips(
                    np.array(x), np.array(y), np.array(yaw), self._feet_under_hips
                )
            )
            if cosine >= _FALL_COSINE and above >= _FALL_HEIGHT:
                if above >= _FALL_HEIGHT + _RISEN:
                    self._note_up(name)
                continue
            detail = f"tilt {math.acos(max(-1.0, cosine)):.2f} rad, height {above:.3f} m"
            if name not in self._excused:
                self._down = tuple(n for n in self.names if n in (*self._down, name))
                events.append(Event.of(self.tick, FALL, name, detail))
            elif name not in self._lying:
                self._lying.add(name)
                events.append(Event.of(self.tick, LIES, name, f"{detail}: no fall"))
        return events

    def _note_up(self, name: str) -> None:
        """A robot is up, and if it falls from now on, it falls; unless it is still stopped."""
        if name not in self._stopped:
            self._excused.discard(name)
            self._lying.discard(name)


@compiled
def _look(q: Array, cosine: float, height: float) -> int:
    """`_UP`: all trunks are level and high enough, by their coordinates q, (n, 19)."""
    found = _UP
    for i in range(len(q)):
        if not np.isfinite(np.sum(q[i])):
            return _NO_NUMBERS
        level = 1.0 - 2.0 * (q[i, 4] * q[i, 4] + q[i, 5] * q[i, 5])
        if not (level >= cosine and q[i, 2] >= height):
            found = _DOWN
    return found
