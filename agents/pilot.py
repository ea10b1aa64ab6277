"""What the planning part of an agent is given, gives and remembers, whoever does the planning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Final, Protocol

from agents.flight import Flight, Present
from agents.modes import Mode
from agents.planner.neighbours import PeerMemory
from agents.planner.peer_terms import PeerTerms
from agents.planner.planner import PlannerInputs, PlannerState
from agents.planner.recursive import Correction
from shared.messages import Measurement, Plan, Reference
from shared.record import record


@record
class Planned:
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
    present: Present = field(default_factory=Present)
    stop_reason: str = ""
    planner_ns: int | None = None
    ages_ms: Mapping[str, float] = field(default_factory=dict)
    unusual: tuple[str, ...] = ()


@record
class Heard:
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
class Awaited:
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


NOTHING: Final = Awaited()
NOTHING_PLANNED: Final = Planned()


@record
class PilotState:
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
    flights: tuple[Flight, ...] = ()
    newest: tuple[int, int] = (-1, 0)
    memory: PeerMemory | None = None
    terms: PeerTerms = field(default_factory=PeerTerms)
    terms_for: int = -1
    inputs: PlannerInputs | None = None
    planner: PlannerState = field(default_factory=PlannerState)
    learned: Correction | None = None


class Pilot(Protocol):
    """The planning part of an agent: `step` is a function of its arguments alone."""

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements it takes in."""
        ...

    def awaited(self, tick: int) -> Awaited:
        """What lock-step waits for before the step of `tick`."""
        ...

    def step(self, state: PilotState, heard: Heard) -> tuple[PilotState, Planned]:
        """Take in what arrived, plan if it is time to, say what to apply now."""
        ...
