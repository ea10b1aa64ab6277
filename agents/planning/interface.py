"""What the planning part of an agent is given, gives and remembers, whoever does the planning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Final, Protocol

from quadriga.agents.modes import Mode
from quadriga.agents.planner.neighbours import PeerMemory
from quadriga.agents.planner.peer_terms import PeerTerms
from quadriga.agents.planner.planner import PlannerInputs, PlannerState
from quadriga.agents.planning.active_plan import ActivePlan, Setpoint
from quadriga.agents.predictor.recursive import Correction
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.messages import Measurement, Plan, Reference


@record
class PlanningOutputs:
    """What one tick of planning gives.

    Attributes:
        plan: a new plan to publish, if one was made.
        present: what to apply now.
        stop_reason: why the robot must stop, or "".
        planner_ns: time that the planner took by the agent's clock; None: no QP was solved.
        ages_ms: age of each plan in use.
        unusual: names of counters of what was out of the ordinary.
    """

    plan: Plan | None = None
    present: Setpoint = field(default_factory=Setpoint)
    stop_reason: str = ""
    planner_ns: int | None = None
    ages_ms: Mapping[str, float] = field(default_factory=dict)
    unusual: tuple[str, ...] = ()


@record
class PlanningInputs:
    """What one tick brings to the planning part.

    Attributes:
        tick: world time.
        mode: what the robot is doing.
        references: what the operator asked for lately.
        measurement: the agent's own sample, if one is due at this tick.
        measurements, plans: others' messages with their senders' names.
    """

    tick: int
    mode: Mode
    references: tuple[Reference, ...]
    measurement: Measurement | None = None
    measurements: tuple[tuple[str, Measurement], ...] = ()
    plans: tuple[tuple[str, Plan], ...] = ()


@record
class Expected:
    """What lock-step must have received before the step of a tick.

    Attributes:
        plan: step and exchange of the plans of those who plan for or with this agent, or None.
        measurement_tick: the peers' measurements up to this tick, or None.
        reference_tick: the operator's reference of this tick, or None.
        truth: whether the simulator's truth of this tick is needed.
    """

    plan: tuple[int, int] | None = None
    measurement_tick: int | None = None
    reference_tick: int | None = None
    truth: bool = False


NOTHING: Final = Expected()
NO_OUTPUTS: Final = PlanningOutputs()


@record
class PlanningState:
    """What the planning part remembers.

    Attributes:
        own: the agent's last samples, T_ini or, if it adapts, T_ini + N of them.
        flights: plans in force or waiting for their start.
        newest: step and exchange of the newest plan.
        memory: peers' messages.
        terms: what the peers will do, for the planning step and exchange `terms_for`.
        inputs: what the plan of the present step was made of.
        planner: what the planner remembers.
        learned: how the plant differs from the predictor's, if the agent adapts.
    """

    own: tuple[Measurement, ...] = ()
    flights: tuple[ActivePlan, ...] = ()
    newest: tuple[int, int] = (-1, 0)
    memory: PeerMemory | None = None
    terms: PeerTerms = field(default_factory=PeerTerms)
    terms_for: int = -1
    inputs: PlannerInputs | None = None
    planner: PlannerState = field(default_factory=PlannerState)
    learned: Correction | None = None


class PlanningInterface(Protocol):
    """The planning part of an agent: `step` is a function of its arguments alone."""

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements it takes in."""
        ...

    def awaited(self, tick: int) -> Expected:
        """What lock-step waits for before the step of `tick`."""
        ...

    def step(
        self, state: PlanningState, heard: PlanningInputs
    ) -> tuple[PlanningState, PlanningOutputs]:
        """Take in what arrived, plan if it is time to, say what to apply now."""
        ...
