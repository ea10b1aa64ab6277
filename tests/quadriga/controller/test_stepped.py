"""When a function of one's own is asked, with what, and what is made of its answer."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.step_io import Inputs
from quadriga.controller import Command, Reference, State, build_command
from quadriga.controller.stepped import ControllerMemory, SteppedController
from quadriga.shared.config.load import load
from quadriga.shared.errors import ProcessError
from quadriga.shared.messages import EStop, Reset, Resume, SafeStop
from tests.a1 import standing

CONFIG = load(None, {"team.robots": 1, "team.agent_command": "walk", "gait.stand_ms": 100})


class Walk:
    """What a function has been asked, tick by tick."""

    def __init__(self) -> None:
        self.asked: dict[int, Reference] = {}
        self._agent = SteppedController(CONFIG, "r1", self._step)
        self._memory: ControllerMemory = self._agent.initial()
        self.mode = self.reason = ""
        self.command: Command | None = None

    def _step(self, state: State, reference: Reference) -> Command:
        self.asked[state.tick] = reference
        return build_command(state, kp=80.0)

    def at(self, tick: int, **said: Any) -> None:
        """A tick, for which the operator asks for 0.5 m/s, with what somebody has said."""
        asked = Reference(tick, 10**6 * tick, 0.5, 0.0, 0.0, 0.26)
        inputs = Inputs(standing(tick), references=(asked,), **said)
        self._memory, out = self._agent.step(self._memory, inputs)
        self.mode, self.reason, self.command = out.mode, out.reason, out.command


def test_it_stands_then_walks_as_it_is_asked() -> None:
    walk = Walk()
    for tick in (0, 99, 100, 200):
        walk.at(tick)
    assert [walk.asked[tick].vx for tick in (0, 99, 100, 200)] == [0.0, 0.0, 0.5, 0.5]
    assert (walk.mode, walk.reason) == ("walk", "")


def test_who_is_asked_to_stop_slows_down_stands_and_goes_on_when_told() -> None:
    walk = Walk()
    for tick in range(0, 1500, 50):
        said: dict[str, Any] = {}
        if tick == 200:
            said["stop"] = SafeStop(tick, 0, "lunch", False)
        if tick == 1000:
            said["resume"] = Resume(tick, 0)
        walk.at(tick, **said)
        if tick == 900:
            assert (walk.mode, walk.reason) == ("stand", "stopped:lunch")
    vx = {tick: reference.vx for tick, reference in walk.asked.items()}
    assert vx[150] == vx[200] == 0.5
    assert vx[450] == pytest.approx(0.25)
    assert vx[700] == vx[950] == 0.0
    assert 0.0 <= vx[1050] < vx[1200] < 0.5, "up to full speed it takes a while again"
    assert (walk.mode, walk.reason) == ("walk", "")


def test_an_emergency_stop_damps_until_it_is_released() -> None:
    walk = Walk()
    walk.at(200, estop=EStop(200, 0, "dog"))
    assert (walk.mode, walk.reason) == ("estop", "estop:dog")
    assert walk.command is not None
    assert walk.command.tick == 200
    assert walk.command.kd.min() > 0.0
    assert not walk.command.kp.any()
    walk.at(300)
    assert walk.asked == {}, "the function is not asked"
    walk.at(400, reset=Reset(400, 0, "me"))
    assert (walk.mode, walk.reason) == ("stand", "reset")
    assert walk.asked[400].vx == 0.0


def test_without_an_operator_it_stops() -> None:
    walk = Walk()
    walk.at(200)
    agent, memory = walk._agent, walk._memory
    for tick in (400, 701, 1300):
        memory, out = agent.step(memory, Inputs(standing(tick)))
    assert (out.mode, out.reason) == ("stand", "reference-lost")


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "step of r1 at tick 5: got NoneType, expected a Command"),
        (build_command(standing(4)), "got a command of tick 4, expected one of tick 5"),
        (
            replace(build_command(standing(5)), kd=np.full(12, np.nan)),
            "step of r1 at tick 5: command.kd: got NaN or infinity, expected finite numbers",
        ),
    ],
    ids=["none", "tick", "nan"],
)
def test_an_answer_that_is_no_command_is_told(answer: Any, message: str) -> None:
    agent = SteppedController(CONFIG, "r1", lambda *_: answer)
    with pytest.raises(ProcessError) as error:
        agent.step(agent.initial(), Inputs(standing(5)))
    assert message in str(error.value)


def test_lock_step_waits_for_the_operator_alone() -> None:
    agent = SteppedController(CONFIG, "r1", lambda state, _: build_command(state))
    ticks = {tick: agent.expected(tick).reference_tick for tick in (0, 1, 99, 100)}
    assert ticks == {0: 0, 1: None, 99: None, 100: 100}
