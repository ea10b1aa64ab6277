"""What the planning part of an agent is given and gives, whoever does the planning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Final, Protocol, TypeVar

from quadriga.agents.planner.solver import SolvedQp
from quadriga.shared.messages import Measurement, Plan, Reference
from quadriga.shared.modes import Mode
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.record import record

S = TypeVar("S")
NEVER_MS: Final = 1 << 40  # of what is never due, some thousand years
REFUSED: Final = "refused_by_planner"  # counter: messages whose content cannot be meant


@record
class PlanningInputs:
    """What one tick brings to the planning part.

    Attributes:
        tick: world time, ms.
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
class ActivePlan:
    """One plan on its way: N samples from `plan_tick` on, in force from `start` on.

    Attributes:
        start: tick from which it is applied.
        plan_tick: tick of its first sample.
        deviation: force deviations from nominal, (N, 12), N.
        outputs: outputs to follow, (N, 6): the planned ones, or in part those asked for.
    """

    start: int
    plan_tick: int
    deviation: Array
    outputs: Array


@record
class PlanningOutputs:
    """What one tick of planning gives.

    Attributes:
        plan: a new plan to publish, if one was made.
        active: a new plan to apply from its start on, if one was made.
        stop_reason: why the robot must stop, or "".
        planner_ns: time that the planner took by the agent's clock; None: no QP was solved.
        ages_ms: age of each plan in use.
        unusual: names of the counters to increase.
    """

    plan: Plan | None = None
    active: ActivePlan | None = None
    stop_reason: str = ""
    planner_ns: int | None = None
    ages_ms: Mapping[str, float] = field(default_factory=dict)
    unusual: tuple[str, ...] = ()


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


class PlanningInterface(Protocol[S]):
    """The planning part of an agent, with a state of type S that only it looks into.

    Its functions depend on their arguments alone, and change none of them. A class that names this
    one as its base needs no more than `initial` and `step`: it then takes in nothing of its peers,
    waits for nobody and solves no QP.
    """

    @property
    def peers(self) -> tuple[str, ...]:
        """Robots whose plans and measurements it takes in."""
        return ()

    @property
    def effect_ms(self) -> int:
        """Ticks that pass at least from a step to the start of what it plans; 0: it is at once."""
        return 0

    def next_due(self, tick: int) -> int:
        """The next tick at which `step` does something although nothing has come in since.

        Of others it changes neither its state nor what the robot does.
        """
        return tick + 1

    def initial(self) -> S:
        """Its state before the first tick."""
        ...

    def expected(self, tick: int) -> Expected:
        """What lock-step waits for before the step of `tick`."""
        return NOTHING

    def step(self, state: S, inputs: PlanningInputs) -> tuple[S, PlanningOutputs]:
        """Take in what arrived, plan if it is time to."""
        ...

    def is_whole(self, state: S, tick: int) -> bool:
        """Whether all that planning takes in is there, of a robot that stands for lack of it."""
        return True

    def problem_of(self, state: S, inputs: PlanningInputs) -> SolvedQp | None:
        """The QP that `step` solves for these arguments; None if it solves none."""
        return None
