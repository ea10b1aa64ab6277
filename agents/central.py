"""The central planner as a pure function: all robots' measurements in, all robots' plans out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from agents.planner.central import TeamPlanner
from agents.planner.episode import commanded_outputs, output_base
from agents.planner.horizon import step_ms
from agents.planner.planner import PlannerInputs
from agents.planning import first_step
from agents.references import base_of_window, in_force, remember_references
from shared.config import Config
from shared.messages import Measurement, Plan, Reference
from shared.robot import robot_names
from shared.topics import SAMPLE_MS

Windows = Mapping[str, tuple[Measurement, ...]]


@dataclass(frozen=True, slots=True)
class CentralState:
    """What the central planner remembers.

    Attributes:
        windows: each robot's last samples, ascending, at most T_ini + those of one step.
        references: what the operator asked for lately.
        step: the last step planned; −1 before the first.
    """

    windows: Windows = field(default_factory=dict)
    references: tuple[Reference, ...] = ()
    step: int = -1


@dataclass(frozen=True, slots=True)
class CentralOutputs:
    """Plans by robot, if there are any, and the time the planner took by the given clock."""

    plans: tuple[tuple[str, Plan], ...] = ()
    planner_ns: int | None = None


class Central:
    """Fixed data of the central planner; `step` is a function of its arguments alone.

    Args:
        config: the team's configuration.
        planner: eq. 7 or eq. 5.
        clock_ns: read around the planner; only `CentralOutputs.planner_ns` depends on it.
    """

    def __init__(
        self, config: Config, planner: TeamPlanner, clock_ns: Callable[[], int] = lambda: 0
    ) -> None:
        self._config, self._planner, self._clock_ns = config, planner, clock_ns
        self._names, self._step_ms = robot_names(config.team.robots), step_ms(config)
        self._kept = config.planner.T_ini + config.planner.applied

    def due(self, state: CentralState) -> int | None:
        """The newest planning step that all robots' windows allow and that is not planned yet."""
        T_ini = self._config.planner.T_ini
        newest = min((self._newest(state.windows, name) for name in self._names), default=-1)
        step = newest // self._step_ms
        if step <= state.step or step < first_step(self._config):
            return None
        end = step * self._step_ms
        whole = all(len(_window(state.windows[name], end, T_ini)) == T_ini for name in self._names)
        return step if whole else None

    def remember(
        self, state: CentralState, measurements: Iterable[tuple[str, Measurement]],
        references: Iterable[Reference],
    ) -> CentralState:  # fmt: skip
        """Add what has arrived; what is repeated, late or of no robot here is passed over."""
        windows = dict(state.windows)
        for name, sample in measurements:
            held = windows.get(name, ())
            newer = not held or sample.tick > held[-1].tick
            if name in self._names and newer and sample.tick % SAMPLE_MS == 0:
                windows[name] = (*held, sample)[-self._kept :]
        now = max((self._newest(windows, name) for name in windows), default=0)
        known = remember_references(state.references, references, now)
        return replace(state, windows=windows, references=known)

    def step(self, state: CentralState) -> tuple[CentralState, CentralOutputs]:
        """Plan the step that is due, if one is."""
        step = self.due(state)
        if step is None:
            return state, CentralOutputs()
        begun = self._clock_ns()
        result = self._planner.step(
            [self._inputs(state, state.windows[name], step) for name in self._names]
        )
        took, tick = self._clock_ns() - begun, step * self._step_ms
        used = dict.fromkeys(self._names, step)
        plans = tuple(
            (name, Plan(tick, tick * 1_000_000, step, u, y, result.status, used, 0))
            for name, u, y in zip(self._names, result.u, result.y, strict=True)
        )
        return replace(state, step=step), CentralOutputs(plans, took)

    def _inputs(
        self, state: CentralState, window: tuple[Measurement, ...], step: int
    ) -> PlannerInputs:
        end, planner = step * self._step_ms, self._config.planner
        samples = _window(window, end, planner.T_ini)
        now, _ = in_force(state.references, end, self._config.reference.height)
        return PlannerInputs(
            step=step,
            u_ini=np.array([sample.u for sample in samples]),
            y_ini=np.array([sample.y for sample in samples]),
            stance_ini=np.array([sample.stance for sample in samples]) > 0.5,
            y_base_ini=base_of_window(self._config, end, state.references),
            y_base=np.tile(output_base(planner.interface, now), (planner.N, 1)),
            y_des=np.tile(commanded_outputs(now), (planner.N, 1)),
        )

    @staticmethod
    def _newest(windows: Windows, name: str) -> int:
        held = windows.get(name)
        return held[-1].tick if held else -1


def _window(held: tuple[Measurement, ...], end: int, T_ini: int) -> tuple[Measurement, ...]:
    """Those of the T_ini samples up to the tick `end` that are there."""
    return tuple(s for s in held if end - SAMPLE_MS * T_ini < s.tick <= end)
