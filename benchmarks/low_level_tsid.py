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
from dataclasses import replace
from typing import Any, Final

import numpy as np

from benchmarks.children import result_of
from benchmarks.low_level_ticks import AgentTick, TsidCase
from quadriga.agents.agent import Agent
from quadriga.agents.controller.whole_body_qp import QP, WholeBodySolution, build_qp, solve_qp
from quadriga.agents.estimator.rigid_body import rigid_body_terms
from quadriga.agents.estimator.robot_state import GAINS, ROBOT_STATE, gains_row
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
    state, found = agent.initial(), []
    for tick in ticks:
        state, _ = agent.step(state, tick.inputs)
        if state.controller_state is not None:
            found.append(TsidCase(state.controller_state))
    return found[config.gait.stand_ms :]


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
    weights = replace(config.controller, tilt_length=1.0, swing_weight=1.0)
    motors = replace(config.motors, rotor_inertia=False)
    ours, peer = _Ours(replace(config, controller=weights, motors=motors)), Tsid(weights)
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


_TORQUE_BOUNDS: Final = np.stack([-A1.torque_limit, A1.torque_limit])


class _Ours:
    """Terms, assembly and solution as in `Controller.control`."""

    def __init__(self, config: Config) -> None:
        self._gains = gains_row(config)
        self._solution: WholeBodySolution | None = None

    def solve(self, case: TsidCase) -> None:
        """One tick's torques."""
        row = np.empty(QP.itemsize // 8)
        free = _whole_body(case.state.row, self._gains, row)
        self._solution = solve_qp(row, free)

    def torques(self) -> Array:
        """Of the last tick, (12,), N·m."""
        assert self._solution is not None
        tau: Array = self._solution.tau
        return tau


@compiled
def _whole_body(row: Array, gains_row: Array, qp: Array) -> bool:
    """Terms and `build_qp`: arrays are cheaper to pass than records."""
    state, gains = row.view(ROBOT_STATE)[0], gains_row.view(GAINS)[0]
    terms = rigid_body_terms(state.q, state.v, gains.links)
    return build_qp(terms, state, gains, _TORQUE_BOUNDS, qp)
