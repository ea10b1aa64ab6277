"""The whole-body part of a tick against TSID: the same robot, the same ticks, the same costs.

Ours is the rigid body's terms, assembly and solution, one compiled call as in the tick; TSID's is
`computeProblemData` and the solution by its own solver (eiquadprog). Setting references and
contacts is not timed.

TSID is no dependency of the project. Its wheel on PyPI is built for another Pinocchio and crashes
with ours; so it is tried in a process of its own.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from benchmarks.children import result_of
from benchmarks.low_level_ticks import AgentTick, TsidCase
from quadriga.agents.agent import Agent
from quadriga.agents.controller.controller import Controller, ControllerOutputs, Task
from quadriga.agents.controller.maths.rigid_body import rigid_body_terms
from quadriga.agents.controller.maths.rows import numbers
from quadriga.agents.controller.model import RigidBody
from quadriga.agents.controller.schedule import Schedule
from quadriga.agents.controller.sensed import Sensed, coordinates_of, feet_of, trunk_of
from quadriga.agents.controller.whole_body.limited import LIMITED, LIMITED_SIZE
from quadriga.agents.controller.whole_body.problem import N_WEIGHTS, Goal, Weights
from quadriga.agents.controller.whole_body.solution import finish, solve_closed_form
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.scheduling import collector_off


def cases(config: Config, predictor: Predictor | None, ticks: list[AgentTick]) -> list[TsidCase]:
    """The whole-body part's inputs at every tick after the stand."""
    agent = Agent(config, "r1", predictor)
    agent._controller = controller = _RecordingController(config)
    memory = agent.initial()
    for tick in ticks:
        memory, _ = agent.step(memory, tick.inputs)
    return controller.cases[config.gait.stand_ms :]


def compare(config: Config, cases: list[TsidCase]) -> dict[str, Any] | None:
    """Run both on every case, see `_compare`; None if TSID is not installed."""
    try:
        answer: dict[str, Any] | None = result_of(_compare, config, cases)
    except ChildProcessError:
        return None
    return answer


def _compare(config: Config, cases: list[TsidCase]) -> dict[str, Any] | None:
    """Median times of both, µs, taking turns to be first, and the difference of their torques."""
    warnings.simplefilter("ignore", RuntimeWarning)  # two of TSID's converters have one type
    try:
        import tsid  # noqa: F401
    except ImportError:
        return None
    from benchmarks.low_level_peer import Tsid

    # TSID gives rotation and translation, and feet and trunk, one weight: so do both here.
    weights = Controller(config).weights._replace(tilt_length=1.0, swing_weight=1.0)
    ours, peer = _Ours(weights), Tsid(weights)
    times, differences = np.empty((2, len(cases))), []
    with collector_off():
        for case in cases[:20]:
            ours.solve(case)
        for k, case in enumerate(cases):
            peer.set(case)
            answers: list[Array] = [np.empty(0), np.empty(0)]
            order: list[tuple[int, Callable[[TsidCase], object], Callable[[], Array]]] = [
                (0, ours.solve, ours.torques), (1, peer.solve, peer.torques),
            ]  # fmt: skip
            for which, solve, torques in order if k % 2 else reversed(order):
                begun = monotonic_ns()
                solve(case)
                times[which, k] = 1e-3 * (monotonic_ns() - begun)
                answers[which] = torques()
            differences.append(np.abs(answers[0] - answers[1]).max())
    median, p99 = np.median(times, axis=1), np.percentile(times, 99, axis=1)
    return {
        "ours_us": float(median[0]),
        "tsid_us": float(median[1]),
        "ours_us_p99": float(p99[0]),
        "tsid_us_p99": float(p99[1]),
        "ratio": float(median[1] / median[0]),
        "torque_difference_median_nm": float(np.median(differences)),
        "ticks": len(cases),
    }


_TORQUE_LIMIT: Final = A1.torque_limit


class _Ours:
    """Terms, assembly and solution as in `Controller.act`."""

    def __init__(self, weights: Weights) -> None:
        self._body, self._weights, self._row = RigidBody(A1), weights, np.array(weights)
        self._solved = np.zeros(LIMITED_SIZE)

    def solve(self, case: TsidCase) -> None:
        """One tick's torques."""
        goal = case.goal
        free = _whole_body(
            case.sensed,
            self._body.links,
            goal.contact,
            goal.trunk,
            goal.swing,
            goal.force,
            self._row,
            self._solved,
        )
        finish(free, self._solved, goal.contact)

    def torques(self) -> Array:
        """Of the last tick, (12,), N·m."""
        return self._solved[LIMITED.x][:12]


@compiled
def _whole_body(
    sensed: Array,
    links: Array,
    contact: Array,
    trunk: Array,
    swing: Array,
    force: Array,
    weights: Array,
    row: Array,
) -> bool:
    """Terms and `solve_closed_form`: arrays are cheaper to pass than tuples."""
    q, v = coordinates_of(sensed)
    return solve_closed_form(
        rigid_body_terms(q, v, links),
        trunk_of(sensed).R,
        feet_of(sensed),
        Goal(contact, trunk, swing, force),
        Weights(*numbers(weights, N_WEIGHTS)),
        _TORQUE_LIMIT,
        row,
    )


class _RecordingController(Controller):
    """A controller that records the inputs of its QP."""

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.cases: list[TsidCase] = []

    def act(
        self, sensed: Sensed, schedule: Schedule, task: Task, dt: float, *, new_sample: bool = False
    ) -> ControllerOutputs:
        outputs = super().act(sensed, schedule, task, dt, new_sample=new_sample)
        goal = Goal(*(part.copy() for part in outputs.goal))
        self.cases.append(TsidCase(sensed.flat.copy(), sensed.q.copy(), sensed.v.copy(), goal))
        return outputs
