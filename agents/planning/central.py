"""The central planner as a pure function: all robots' measurements in, all robots' plans out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

from quadriga.agents.gait import first_step, step_ms
from quadriga.agents.planner.team import TeamPlanner
from quadriga.agents.planning.references import build_planner_inputs, remember_references
from quadriga.agents.plausibility import is_plausible
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan, Reference
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import SAMPLE_MS

Window = tuple[Measurement, ...]


@dataclass(frozen=True, slots=True)
class CentralState:
    """What the central planner remembers.

    Attributes:
        windows: each robot's last samples, ascending, at most T_ini + those of one step.
        references: what the operator asked for lately.
        refused: samples with implausible numbers so far.
        step: the last step planned; −1 before the first.
    """

    windows: Mapping[str, Window] = field(default_factory=dict)
    references: tuple[Reference, ...] = ()
    refused: int = 0
    step: int = -1


@dataclass(frozen=True, slots=True)
class CentralOutputs:
    """Plans by robot, if there are any, and the time the planner took by the given clock."""

    plans: tuple[tuple[str, Plan], ...] = ()
    planner_ns: int | None = None


class Central:
    """Fixed data of the central planner of eq. 7 or eq. 5; functions of their arguments alone.

    `clock_ns` is read around the planner; only `CentralOutputs.planner_ns` depends on it.
    """

    def __init__(
        self, config: Config, planner: TeamPlanner, clock_ns: Callable[[], int] = lambda: 0
    ) -> None:
        self._config, self._planner, self._clock_ns = config, planner, clock_ns
        self._names, self._step_ms = robot_names(config.team.robots), step_ms(config)
        self._kept = config.planner.T_ini + config.planner.applied

    def due(self, state: CentralState) -> int | None:
        """The newest planning step that all robots' windows allow and that is not planned yet.

        None once a robot stands where it should walk: it has stopped or is damped, and without
        plans the others stop too.
        """
        newest = min(_newest(state.windows.get(name, ())) for name in self._names)
        step = newest // self._step_ms
        if step <= state.step or step < first_step(self._config):
            return None
        for name in self._names:
            window = self._window(state, name, step)
            if len(window) < self._config.planner.T_ini:
                return None
            begun = window[-1].tick - SAMPLE_MS >= self._config.gait.stand_ms
            if begun and (window[-1].stance > 0.5).all():  # in a trot two feet swing
                return None
        return step

    def remember(
        self,
        state: CentralState,
        measurements: Iterable[tuple[str, Measurement]],
        references: Iterable[Reference],
    ) -> CentralState:
        """Add what has arrived; what is repeated, late or of no robot here is passed over."""
        windows, refused = dict(state.windows), state.refused
        for name, sample in measurements:
            held = windows.get(name, ())
            if name not in self._names or sample.tick <= _newest(held) or sample.tick % SAMPLE_MS:
                continue
            if is_plausible(self._config, sample.u, sample.y):
                windows[name] = (*held, sample)[-self._kept :]
            else:
                refused += 1
        now = max(map(_newest, windows.values()), default=0)
        known = remember_references(state.references, references, now)
        return replace(state, windows=windows, references=known, refused=refused)

    def step(self, state: CentralState) -> tuple[CentralState, CentralOutputs]:
        """Plan the step that is due, if one is."""
        step = self.due(state)
        if step is None:
            return state, CentralOutputs()
        tick, begun = step * self._step_ms, self._clock_ns()
        windows = [self._window(state, name, step) for name in self._names]
        result = self._planner.step(
            [build_planner_inputs(self._config, step, tick, w, state.references) for w in windows]
        )
        took, used = self._clock_ns() - begun, dict.fromkeys(self._names, step)
        plans = tuple(
            (name, Plan(tick, tick * 1_000_000, step, u, y, result.status, used, 0))
            for name, u, y in zip(self._names, result.u, result.y, strict=True)
        )
        return replace(state, step=step), CentralOutputs(plans, took)

    def _window(self, state: CentralState, name: str, step: int) -> Window:
        """Those of a robot's T_ini samples up to a step that are there."""
        end = step * self._step_ms
        begin = end - SAMPLE_MS * self._config.planner.T_ini
        return tuple(sample for sample in state.windows[name] if begin < sample.tick <= end)


def _newest(window: Window) -> int:
    return window[-1].tick if window else -1
