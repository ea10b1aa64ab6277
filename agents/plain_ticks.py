"""Ticks at which nothing but a state has come: one compiled call each, from row to row.

What a tick is otherwise made of, mode, reference, plan in force, cannot change in such a tick
before a tick that is known beforehand. The compiled call is the sequence of those of `Agent.step`,
so that both give the same bytes. At a tick at which planning is due, or a sample ends, it answers
the state too, if what is planned takes effect later; `Agent.step` then does the rest.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.agent import QP_CONSTRAINED, Acted, Agent, AgentState
from quadriga.agents.controller.controller import control_rows
from quadriga.agents.controller.trunk import COMMAND as ASKED
from quadriga.agents.controller.whole_body_qp import (
    CONSTRAINED,
    QP,
    UNCONSTRAINED,
    WholeBodySolution,
    solve_qp,
)
from quadriga.agents.estimator.estimator import NO_TRUTH, estimate_rows
from quadriga.agents.estimator.robot_state import GAINS, ROBOT_STATE, RobotState
from quadriga.agents.plausibility import is_measurable, measured_limits
from quadriga.agents.validate import READINGS, validate_rows
from quadriga.shared.link.packets import STATE_SIZE
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.runtime.jit import compiled

# What is remembered from tick to tick, in one row: readings and robot.
_READINGS: Final = slice(0, READINGS.itemsize // 8)
_ROBOT: Final = slice(_READINGS.stop, _READINGS.stop + ROBOT_STATE.itemsize // 8)
# What a tick is computed in: the estimated robot, the QP, what the controller is asked.
_ESTIMATED: Final = slice(0, ROBOT_STATE.itemsize // 8)
_QP: Final = slice(_ESTIMATED.stop, _ESTIMATED.stop + QP.itemsize // 8)
_ASKED: Final = slice(_QP.stop, _QP.stop + ASKED.itemsize // 8)
# What never changes: gains, greatest readings, limits of angles, least cosine of the tilt.
_GAINS: Final = slice(0, GAINS.itemsize // 8)
_MOST: Final = slice(_GAINS.stop, _GAINS.stop + STATE_SIZE)
_LOWER: Final = slice(_MOST.stop, _MOST.stop + N_JOINTS)
_UPPER: Final = slice(_LOWER.stop, _LOWER.stop + N_JOINTS)
_FALLEN_COSINE: Final = _UPPER.stop
_UPRIGHT: Final = RobotState.CUTS["R"][0].stop - 1  # of a robot's row: R[2, 2]
_TAU: Final = WholeBodySolution.CUTS["tau"][0]
_DT: Final = 1e-3  # s
_NEVER: Final = -1
# What has come of a compiled tick: the QP's optimum keeps its limits; one is active; or the tick
# is not plain: a reading is invalid or no number, or the trunk has tilted.
_FREE, _AT_LIMIT, _NOT_PLAIN = 0, 1, 2


class PlainTicks:
    """The plain ticks between two steps of an agent, and what they are computed in.

    Args:
        agent: whose ticks they are.

    Attributes:
        agent: as given.
        plans_at_once: whether a plan takes effect at the tick at which it is made.
    """

    def __init__(self, agent: Agent) -> None:
        self.agent, self.plans_at_once = agent, agent.plans_at_once
        self._memory, self._turn = np.zeros((2, _ROBOT.stop)), 0
        self._work = np.zeros(_ASKED.stop)
        self._qp: Array = self._work[_QP]
        most, checks = measured_limits(agent.config.robot), agent.validator
        self._fixed = np.concatenate(
            [agent.gains, most, checks.lower, checks.upper, [agent.fallen_cosine]]
        )
        self._state: AgentState | None = None  # after the last step
        self._next = self._last = self._due = self._change = _NEVER
        self._limited = 0  # plain ticks at which a limit of the QP was active
        self._at_limit = False  # whether one was at the last
        self._tau = np.zeros(N_JOINTS)
        state, gait = np.zeros(len(most)), agent.gait.at(0, agent.initial().mode)
        self._run(state, gait)  # compiled, or loaded, now

    def arm(self, state: AgentState) -> None:
        """Begin behind a step of the agent; its state tells until when ticks can be plain."""
        self._state, self._limited = state, 0
        self._next = self._change = state.tick + 1
        self._due, self._last = self.agent.plain_until(state)
        if self._last >= self._next and state.controller_state is not None:
            self._memory[self._turn, _READINGS] = state.readings
            self._memory[self._turn, _ROBOT] = state.controller_state.row

    def answers(self, tick: int) -> bool:
        """Whether the state of a tick can be answered so, if nothing that matters has come."""
        return tick == self._next <= self._last

    def is_due(self, tick: int) -> bool:
        """Whether more than an answer is due at this tick."""
        return tick == self._due

    def answer(self, tick: int, reading: Array) -> Array | None:
        """Torques for a state, `State.row`, (12,), N·m; None: this tick is not plain."""
        agent, state = self.agent, self._state
        assert state is not None
        if tick >= self._change:
            self._change, self._work[_ASKED] = agent.plain_command(state, tick)
        came = self._run(reading, agent.gait.at(tick, state.mode))
        self._at_limit = came == _AT_LIMIT
        if came == _NOT_PLAIN or (self._at_limit and not solve_qp(self._qp, free=False).solved):
            self._last = _NEVER
            return None
        tau: Array = self._qp[_TAU]
        return tau

    def keep(self) -> None:
        """Go on behind the tick that was answered, at which nothing else is due."""
        self._turn = 1 - self._turn
        self._tau[:] = self._qp[_TAU]
        self._limited += self._at_limit
        self._next += 1

    @property
    def acted(self) -> Acted:
        """What the tick that was answered has come to, for the rest of its step."""
        row = self._memory[1 - self._turn].copy()
        status = CONSTRAINED if self._at_limit else UNCONSTRAINED
        solution = WholeBodySolution(self._qp.copy(), status)
        estimated = RobotState(self._work[_ESTIMATED].copy())
        return Acted(row[_READINGS], estimated, RobotState(row[_ROBOT]), solution)

    @property
    def state(self) -> AgentState | None:
        """The agent's state behind the ticks that were kept; None before the first step."""
        state = self._state
        if state is None or self._next == state.tick + 1:
            return state
        row, counters = self._memory[self._turn].copy(), dict(state.counters)
        if self._limited:
            counters[QP_CONSTRAINED] = counters.get(QP_CONSTRAINED, 0) + self._limited
        return replace(
            state,
            tick=self._next - 1,
            controller_state=RobotState(row[_ROBOT]),
            last_tau=self._tau.copy(),
            counters=counters,
            readings=row[_READINGS],
        )

    def _run(self, reading: Array, schedule: Array) -> int:
        return _plain_tick(self._memory, self._turn, self._work, reading, schedule, self._fixed)


@compiled
def _plain_tick(
    memory: Array, turn: int, work: Array, reading: Array, schedule: Array, fixed: Array
) -> int:
    """One tick, from what is remembered before it, `memory[turn]`, to after it, in the other row.

    A call costs by the number of its arrays. So what is computed in is one, `work`, and what never
    changes another, `fixed`.
    """
    before, after, estimated = memory[turn], memory[1 - turn], work[_ESTIMATED]
    if not is_measurable(reading, fixed[_MOST]):
        return _NOT_PLAIN
    after[_READINGS] = before[_READINGS]
    if not validate_rows(after[_READINGS], reading, fixed[_LOWER], fixed[_UPPER], _DT):
        return _NOT_PLAIN
    gains = fixed[_GAINS]
    estimate_rows(before[_ROBOT], estimated, reading, schedule, _DT, gains, NO_TRUTH)
    if not estimated[_UPRIGHT] >= fixed[_FALLEN_COSINE]:
        return _NOT_PLAIN
    free = control_rows(estimated, after[_ROBOT], work[_ASKED], gains, work[_QP])
    return _FREE if free else _AT_LIMIT
