"""A plain function in the place of an agent: when it is asked, and what is made of its answer.

What it remembers between ticks is its own, so that nobody but itself can compute it again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.modes import ResumeState, ramp, requested_stops, slowed
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.planning.references import reference_at, remember_references
from quadriga.agents.step_io import Inputs, Outputs
from quadriga.plant.commands import damp_joints
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import Command, Reference, State
from quadriga.shared.modes import (
    REFERENCE_LOST,
    RESET,
    STAND,
    STOPPING,
    WALK,
    Mode,
    Stop,
    next_mode,
    resolve_stops,
)
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import REFERENCE, REFERENCE_EPOCH_MS

Step = Callable[[State, Reference], Command]
"""From what the robot measures and what is asked of it to its motor command."""

_CAUSE: Final = "see docs/messages.md#command"


def build_command(
    state: State,
    *,
    tau: ArrayLike = 0.0,
    q_des: ArrayLike = 0.0,
    v_des: ArrayLike = 0.0,
    kp: ArrayLike = 0.0,
    kd: ArrayLike = 0.0,
) -> Command:
    """The command that answers a state; motors apply `tau + kp (q_des − q) + kd (v_des − v)`.

    Each field is an array (12,) in the order of the joints, or one number for all of them.

    Args:
        state: what it answers.
        tau: torque, N·m.
        q_des: angle, rad.
        v_des: rate, rad/s.
        kp: stiffness, N·m/rad.
        kd: damping, N·m·s/rad.

    Raises:
        ProcessError: a field has another shape.
    """
    fields = {"tau": tau, "q_des": q_des, "v_des": v_des, "kp": kp, "kd": kd}
    row = np.empty(len(fields) * N_JOINTS)
    for name, value in fields.items():
        shape = np.shape(value)
        if shape not in ((), (N_JOINTS,)):
            raise ProcessError(f"command.{name}", f"shape {shape}", "() or (12,)", _CAUSE)
        row[Command.CUTS[name]] = value
    return Command.from_row(state.tick, state.stamp_ns, row)


@record
class ControllerMemory:
    """What is remembered between ticks of what concerns everybody's robots."""

    tick: int
    mode: Mode
    references: tuple[Reference, ...] = ()
    resume: ResumeState = field(default_factory=ResumeState)


class SteppedController:
    """A plain function as an agent: it hears of stops only as a reference of no speed.

    Args:
        config: the team's configuration.
        robot: the robot's name.
        step: the function.
    """

    def __init__(self, config: Config, robot: str, step: Step) -> None:
        self.robot = robot
        self._step: Callable[[State, Reference], Any] = step
        self._stand_ms, self._height = config.gait.stand_ms, config.reference.height

    def initial(self) -> ControllerMemory:
        """Before the first tick."""
        return ControllerMemory(-1, Mode(STAND, 0))

    def expected(self, tick: int) -> Expected:
        """What lock-step waits for before the step of `tick`: the operator's reference."""
        return NOTHING if tick % REFERENCE_EPOCH_MS else Expected(reference_tick=tick)

    def step(self, state: ControllerMemory, inputs: Inputs) -> tuple[ControllerMemory, Outputs]:
        """Advance to the tick of `inputs.state`.

        Raises:
            ProcessError: the function's answer is no command of finite numbers.
        """
        tick = inputs.state.tick
        references = remember_references(state.references, inputs.references, tick)
        _, age = reference_at(references, tick, self._height)
        mode = self._course(state.mode, inputs, led=age <= REFERENCE.max_age_ms)
        resumes = state.mode.may_resume and mode.name == WALK
        resume = ResumeState(resumed=tick) if resumes else state.resume
        if mode.passive:
            command = damp_joints(tick)
        else:
            followed, _ = reference_at(ramp(references, resume, tick), tick, self._height)
            answer = self._step(inputs.state, slowed(followed, mode.speed_factor(tick)))
            command = self._check(answer, tick)
        ages = {REFERENCE.name: float(age)}
        outputs = Outputs(command, None, None, mode.name, mode.reason, {}, ages, None)
        return ControllerMemory(tick, mode, references, resume), outputs

    def _course(self, mode: Mode, inputs: Inputs, *, led: bool) -> Mode:
        """The mode at this tick: what people have said, and whether an operator is there."""
        tick, stops = inputs.state.tick, requested_stops(inputs)
        if mode.passive and inputs.reset is not None and inputs.estop is None:
            mode = Mode(STAND, tick, RESET)
        elif mode.may_resume and mode.name == STAND and inputs.resume is not None:
            mode = Mode(WALK, tick)
        else:
            mode = next_mode(mode, tick, self._stand_ms, stance_ends=True)
        if mode.name == WALK and not led:
            stops.append(Stop(STOPPING, REFERENCE_LOST))
        return resolve_stops(mode, tick, stops)

    def _check(self, answer: Any, tick: int) -> Command:
        """What the function has answered, if it is a command of this tick.

        Raises:
            ProcessError: it is not.
        """
        name = f"step of {self.robot} at tick {tick}"
        if not isinstance(answer, Command):
            got = type(answer).__name__
            raise ProcessError(name, got, "a Command", "`build_command` makes one")
        if answer.tick != tick:
            raise ProcessError(name, f"a command of tick {answer.tick}", f"one of tick {tick}")
        if not np.isfinite(answer.row).all():
            wrong = [n for n, cut in Command.CUTS.items() if not np.isfinite(answer.row[cut]).all()]
            raise ProcessError(
                f"{name}: command.{wrong[0]}", "NaN or infinity", "finite numbers", _CAUSE
            )
        return answer
