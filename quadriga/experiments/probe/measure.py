"""The true response of a team to a pulse of one robot: the same walk with and without it.

Both have the same random numbers, so their difference has no noise: it is what the pulse did.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from quadriga.experiments.probe.branch import run_branch
from quadriga.experiments.probe.pulses import DIRECTIONS, PULSE_MS, pulse_forces, pulse_starts
from quadriga.experiments.probe.responses import Repetition
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config
from quadriga.shared.modes import PASSIVE
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array, robot_names
from quadriga.shared.topics import SAMPLE_MS
from quadriga.team.operator import references_of

_NO_FORCE = np.zeros(N_FORCES)


def probed_config(config: Config, seed: int) -> Config:
    """The walk that pulses are given in: the low level alone, in the world of this seed."""
    world, planner = replace(config.world, seed=seed), replace(config.planner, kind="none")
    return replace(config, world=world, planner=planner)


@dataclass(frozen=True, slots=True)
class _Pulse:
    """A force deviation (12,) of one robot in the `PULSE_MS` from tick `start` on."""

    robot: str
    start: int
    force: Array


class PulsedWalk:
    """A walk of the low level alone, and what it would be with a pulse."""

    def __init__(self, config: Config) -> None:
        self._names, self._horizon = robot_names(config.team.robots), config.planner.N
        self._rollout = Rollout(config, None, references_of(config), self._excitation)
        self._pulse: _Pulse | None = None
        self._samples: dict[int, Array] = {}  # by tick: forces and outputs of each robot, (n, 18)
        self._down_from: int | None = None  # tick of the first fall

    def walk_to(self, tick: int) -> None:
        """Walk until the world is at `tick`; not farther than to the first fall."""
        while self._down_from is None and self._rollout.world.tick < tick:
            now = self._rollout.step()
            gave_up = any(out.mode == PASSIVE for out in now.outputs.values())
            if gave_up or self._rollout.world.fallen():
                self._down_from = now.tick
            measured = [now.outputs[name].measurement for name in self._names]
            samples = [sample for sample in measured if sample is not None]
            if samples:
                self._samples[now.tick] = np.array([[*each.u, *each.y] for each in samples])

    def give_pulse(self, robot: int, start: int, force: Array) -> None:
        """Have a robot add `force`, (12,), N, to its forces in the `PULSE_MS` from `start` on."""
        self._pulse = _Pulse(self._names[robot], start, force)

    def horizon_after(self, start: int) -> Array:
        """Walk over the horizon of a plan made at `start`; the samples in it.

        Returns:
            Forces and outputs, shape (N, n, 18); NaN if a robot fell in it or before.
        """
        ticks = start + SAMPLE_MS * np.arange(1, self._horizon + 1)
        last = int(ticks[-1])
        self.walk_to(last + 1)
        if self._down_from is not None and self._down_from <= last:
            return np.full((self._horizon, len(self._names), N_FORCES + N_OUTPUTS), np.nan)
        return np.array([self._samples[tick] for tick in ticks.tolist()])

    def horizon_with_pulse(self, robot: int, start: int, force: Array) -> Array:
        """`horizon_after` as it would be with a pulse. The walk itself does not go on."""
        answer = run_branch(partial(self._horizon_bytes, robot, start, force))
        shape = (self._horizon, len(self._names), N_FORCES + N_OUTPUTS)
        return np.frombuffer(answer).reshape(shape)

    def _horizon_bytes(self, robot: int, start: int, force: Array) -> bytes:
        self.give_pulse(robot, start, force)
        return self.horizon_after(start).tobytes()

    def _excitation(self, robot: str, tick: int) -> Array:
        pulse = self._pulse
        if pulse is None or robot != pulse.robot:
            return _NO_FORCE
        return pulse.force if pulse.start <= tick < pulse.start + PULSE_MS else _NO_FORCE


def measure_robot(config: Config, seed: int, robot: int) -> Repetition:
    """Responses of the team to every pulse of one robot, in the world of a seed.

    Pulses of worlds with odd seeds are negative, and so are their responses as they are stored: in
    the mean over seeds what does not change its sign with the pulse cancels out.

    Returns:
        With one pulsed robot, so the second axis of `u` and `y` has length 1.
    """
    walk, starts = PulsedWalk(probed_config(config, seed)), pulse_starts(config)
    sign = -1.0 if seed % 2 else 1.0
    n, N = config.team.robots, config.planner.N
    with_pulse = np.empty((len(starts), len(DIRECTIONS), N, n, N_FORCES + N_OUTPUTS))
    for p, start in enumerate(starts.tolist()):
        walk.walk_to(start)
        forces = sign * pulse_forces(config, robot, start)
        for d, force in enumerate(forces):
            with_pulse[p, d] = walk.horizon_with_pulse(robot, start, force)
    without = np.array([walk.horizon_after(start) for start in starts.tolist()])
    difference = sign * (with_pulse - without[:, None])[:, None]
    u, y = difference[..., robot, :N_FORCES], difference[..., N_FORCES:]
    return Repetition(seed, starts, u, y)


def join_robots(parts: list[Repetition]) -> Repetition:
    """One repetition from those of each pulsed robot, in their order."""
    u, y = (np.concatenate([getattr(part, name) for part in parts], axis=1) for name in ("u", "y"))
    return replace(parts[0], u=u, y=y)
