"""The central planner as a pure function: all robots' measurements in, all robots' plans out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.team_planner import TeamPlanner
from quadriga.agents.planning.active_plan import FARTHEST, PlanCheck
from quadriga.agents.planning.operator_references import AHEAD_MS, reference_at, remember_references
from quadriga.agents.planning.reference_slew import ReferenceSlew
from quadriga.agents.planning.window import build_planner_inputs
from quadriga.agents.plausibility import is_plausible
from quadriga.agents.time_grid import first_step, step_ms
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan, Reference
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import MEASUREMENT, SAMPLE_MS

Windows = Mapping[str, tuple[Measurement, ...]]
_AHEAD_MS: Final = MEASUREMENT.max_age_ms  # of the team's time, of a sample that is believed


@dataclass(frozen=True, slots=True)
class CentralState:
    """What the central planner remembers.

    Attributes:
        windows: each robot's last samples, ascending, at most T_ini + those of one step.
        references: what the operator asked for lately.
        claimed: by robot, tick of a sample that was not believed, until one is.
        refused: messages of a time too far ahead, or with implausible numbers, so far.
        step: the last step planned; −1 before the first.
    """

    windows: Windows = field(default_factory=dict)
    references: tuple[Reference, ...] = ()
    claimed: Mapping[str, int] = field(default_factory=dict)
    refused: int = 0
    step: int = -1


@dataclass(frozen=True, slots=True)
class CentralOutputs:
    """Plans by robot, if there are any, the time the planner took by the given clock, counters."""

    plans: tuple[tuple[str, Plan], ...] = ()
    planner_ns: int | None = None
    unusual: tuple[str, ...] = ()


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
        self._slew = ReferenceSlew(config)
        self._checks = [PlanCheck(config, index) for index in range(config.team.robots)]

    def due(self, state: CentralState) -> int | None:
        """The newest planning step that all robots' windows allow and that is not planned yet.

        None once a robot stands where it should walk: it has stopped or is damped, and without
        plans the others stop too.
        """
        T_ini = self._config.planner.T_ini
        newest = min((self._newest(state.windows, name) for name in self._names), default=-1)
        step = newest // self._step_ms
        if step <= state.step or step < first_step(self._config):
            return None
        end = step * self._step_ms
        windows = [_window(state.windows[name], end, T_ini) for name in self._names]
        whole = all(len(window) == T_ini for window in windows)
        return step if whole and not any(map(self._stands, windows)) else None

    def _stands(self, window: tuple[Measurement, ...]) -> bool:
        """Whether at the end of a window all four feet stand: in a trot two of them swing."""
        last = window[-1]
        begun = last.tick - SAMPLE_MS >= self._config.gait.stand_ms
        return begun and bool((last.stance > 0.5).all())

    def remember(
        self,
        state: CentralState,
        measurements: Iterable[tuple[str, Measurement]],
        references: Iterable[Reference],
    ) -> CentralState:
        """Add what has arrived; what is repeated, late or of no robot here is passed over.

        References are approached as agents do, see `ReferenceSlew`.

        Refused and counted is what nobody can mean, and what is far ahead of the team's time, which
        is the median of its robots' newest samples: behind it all that is real would be late.
        After a silence of all the team's time goes on when most have spoken again.
        """
        windows, claimed, refused = dict(state.windows), dict(state.claimed), state.refused
        for name, sample in measurements:
            newer = sample.tick > self._newest(windows, name)
            if name not in self._names or not newer or sample.tick % SAMPLE_MS:
                continue
            if not is_plausible(self._config, sample.u, sample.y):
                refused += 1
                continue
            if sample.tick > self._team_time(windows, claimed) + _AHEAD_MS:
                claimed[name] = sample.tick
                refused += 1
                continue
            claimed.pop(name, None)
            windows[name] = (*windows.get(name, ()), sample)[-self._kept :]
        now = max((self._newest(windows, name) for name in windows), default=0)
        arrived = tuple(references)
        timely = tuple(item for item in arrived if item.tick <= now + AHEAD_MS)
        known = state.references
        for item in timely:
            known = remember_references(known, (self._slew.limit_after(known, item),), now)
        return replace(
            state,
            windows=windows,
            references=known,
            claimed=claimed,
            refused=refused + len(arrived) - len(timely),
        )

    def _team_time(self, windows: Windows, claimed: Mapping[str, int]) -> int:
        """The (lower) median of the robots' newest samples, those not believed among them, ms."""
        newest = [claimed.get(name, self._newest(windows, name)) for name in self._names]
        return sorted(newest)[(len(newest) - 1) // 2]

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
        used, stamp_ns = dict.fromkeys(self._names, step), tick * 1_000_000
        reference, _ = reference_at(state.references, tick, self._config.reference.height)
        plans, unusual = [], []
        # What is not of all robots has no robot's shape: it is refused for each of them.
        each = [
            values if np.shape(values)[:1] == (len(self._names),) else [values] * len(self._names)
            for values in (result.u, result.y)
        ]
        for name, check, u, y in zip(self._names, self._checks, *each, strict=True):
            plan = Plan(tick, stamp_ns, step, u, y, result.status, used, 0)
            if fault := check.fault_of(plan, tick, FARTHEST):
                plan = check.replacement(plan, fault, tick, reference)
                unusual.append(check.counter)
            plans.append((name, plan))
        return replace(state, step=step), CentralOutputs(tuple(plans), took, tuple(unusual))

    def _inputs(
        self, state: CentralState, window: tuple[Measurement, ...], step: int
    ) -> PlannerInputs:
        end = step * self._step_ms
        samples = _window(window, end, self._config.planner.T_ini)
        return build_planner_inputs(self._config, step, end, samples, state.references)

    @staticmethod
    def _newest(windows: Windows, name: str) -> int:
        held = windows.get(name)
        return held[-1].tick if held else -1


def _window(held: tuple[Measurement, ...], end: int, T_ini: int) -> tuple[Measurement, ...]:
    """Those of the T_ini samples up to the tick `end` that are there."""
    return tuple(s for s in held if end - SAMPLE_MS * T_ini < s.tick <= end)
