"""What one step of an agent takes in, and what it gives."""

from __future__ import annotations

from collections.abc import Mapping

from quadriga.shared.messages import (
    Command,
    EStop,
    Measurement,
    Plan,
    Reference,
    Reset,
    Resume,
    SafeStop,
    State,
    Status,
    Truth,
)
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.record import record


@record
class Inputs:
    """Everything that reached the agent since its last step, sorted by robot, then tick.

    Attributes:
        state: the robot's own sensors at this tick.
        measurements: samples of peers, with the peer's name.
        plans: plans of peers, or of whoever plans for the robot, with the sender's name.
        references: of the operator.
        estop: an emergency stop, if one came.
        stop: somebody's request that the team slow down and stand, if it came.
        reset: the operator's release of an emergency stop, if it came.
        resume: the operator's request to go on, if it came.
        statuses: of the other robots, with their names.
        truth: of the simulator, only for the estimator "truth".
        excitation: force deviation to add, (12,), N, yaw frame; data collection only.
    """

    state: State
    measurements: tuple[tuple[str, Measurement], ...] = ()
    plans: tuple[tuple[str, Plan], ...] = ()
    references: tuple[Reference, ...] = ()
    estop: EStop | None = None
    truth: Truth | None = None
    excitation: Array | None = None
    stop: SafeStop | None = None
    reset: Reset | None = None
    resume: Resume | None = None
    statuses: tuple[tuple[str, Status], ...] = ()

    @property
    def bare(self) -> bool:
        """Whether nothing but the state has come."""
        others = self.measurements or self.plans or self.references or self.statuses
        return not (others or any(self.requests)) and self.truth is None

    @property
    def requests(self) -> tuple[EStop | SafeStop | Reset | Resume | None, ...]:
        """What people have asked for, in the order of `shared.topics.REQUESTS`."""
        return self.estop, self.stop, self.reset, self.resume


@record
class Outputs:
    """What one step of the agent gives: the command always, the rest when it is due.

    `planner_ns` is for telemetry: the planner's time by the agent's clock, None if it did not plan.
    """

    command: Command
    measurement: Measurement | None
    plan: Plan | None
    mode: str
    reason: str
    counters: Mapping[str, int]
    ages_ms: Mapping[str, float]
    planner_ns: int | None
