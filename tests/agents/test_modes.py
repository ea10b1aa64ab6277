"""When a robot stops for the others, and when one that stood walks again, and how fast."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.agents.agent import Inputs
from quadriga.agents.modes import (
    GRACE_MS,
    RAMP_MS,
    REQUEST_MS,
    SILENCE_MS,
    ModeRules,
    ResumeState,
    change_event,
    ramp,
)
from quadriga.agents.validate import AGREES_MS
from quadriga.identification.rollout import Rollout
from quadriga.shared import messages as msg
from quadriga.shared.codes import HALTS, INPUT_LOST, RESUMED
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import EStop, SafeStop, Status
from quadriga.shared.modes import COMMANDED, ESTOP, LOSSES, PASSIVE, STAND, STOPPING, WALK, Mode
from tests.a1 import standing
from tests.agents.duet import CONFIG, asked, every_100_ms, simple_predictor
from tests.agents.lone_robot import ALONE, Robot, tilted

AUTO = replace(ALONE, team=replace(ALONE.team, auto_resume=True))
RESUME_MS = round(1000 * ALONE.team.resume_after)
LOST = Mode(STAND, 1700, "reference-lost")
BEGIN = 8100  # tick, 300 + k · 200: a half cycle begins


def begins(config: Config, mode: Mode, since: int, requested: int = -1, tick: int = BEGIN) -> bool:
    """Whether a robot in a mode, whose inputs are there since a tick, walks at a later one."""
    resume = ResumeState(inputs_ok_since=since, requested=requested)
    return ModeRules(config, "r1").course(mode, resume, tick - 1, tick)[0] == Mode(WALK, tick)


@pytest.mark.parametrize("reason", sorted(LOSSES))
def test_after_a_loss_it_resumes_once_all_inputs_have_been_there_for_a_second(reason: str) -> None:
    mode = Mode(STAND, 1700, f"{reason}:r2")
    assert begins(AUTO, mode, BEGIN - RESUME_MS)
    assert not begins(AUTO, mode, BEGIN - RESUME_MS + 1)
    assert not begins(AUTO, mode, BEGIN - RESUME_MS, tick=BEGIN + 1), "in the midst of a half cycle"
    assert not begins(ALONE, mode, BEGIN - RESUME_MS)
    assert begins(ALONE, mode, BEGIN - RESUME_MS, requested=BEGIN - REQUEST_MS)
    assert not begins(ALONE, mode, BEGIN - RESUME_MS, requested=BEGIN - REQUEST_MS - 1)


@pytest.mark.parametrize("reason", sorted(COMMANDED))
def test_after_a_stop_or_a_reset_it_resumes_only_when_asked_to(reason: str) -> None:
    mode = Mode(STAND, 1700, f"{reason}:ann")
    assert not begins(AUTO, mode, 2000)
    assert begins(AUTO, mode, 2000, requested=BEGIN - 100)
    for never in (
        Mode(PASSIVE, 5, "fall"),
        Mode(ESTOP, 5, "estop:reference-lost"),
        Mode(STAND, 5, "balance-lost"),
        Mode(STOPPING, BEGIN - 5, "reference-lost"),
    ):
        assert not begins(AUTO, never, 10, requested=BEGIN - 10)


def test_references_rise_from_nothing_within_a_second() -> None:
    references = tuple(replace(asked(0.4), tick=tick) for tick in range(4000, 6000, 100))
    assert ramp(references, ResumeState(), 5000) is references
    followed = ramp(references, ResumeState(resumed=4500), 5000)
    speeds = {item.tick: item.vx for item in followed}
    assert (speeds[4000], speeds[4500]) == (0.0, 0.0)
    assert speeds[4500 + RAMP_MS // 2] == pytest.approx(0.2)
    assert followed[-1] is references[-1]


@pytest.mark.parametrize(
    ("before", "after", "code", "detail"),
    [
        (Mode(WALK, 3), Mode(STOPPING, 9, "peer-lost:r2"), INPUT_LOST, "stands: peer-lost:r2"),
        (Mode(WALK, 3), Mode(STOPPING, 9, "stopped:dog"), HALTS, "stands: stopped:dog"),
        (LOST, Mode(WALK, 9), RESUMED, "walks again after reference-lost"),
        (Mode(STOPPING, 5, "peer-lost"), LOST, "", ""),
        (Mode(STAND, 0), Mode(WALK, 9), "", ""),
        (Mode(STAND, 0), Mode(PASSIVE, 9, "fall"), "", ""),
    ],
)
def test_a_loss_and_a_return_are_announced(
    before: Mode, after: Mode, code: str, detail: str
) -> None:
    event = change_event(before, after, 9, "r1")
    assert (event is None) == (not code)
    if event is not None:
        assert (event.code, event.robot, event.kind) == (code, "r1", "fault")
        assert event.detail.endswith(detail)


def stood(config: Config) -> Robot:
    """A robot whose operator was silent from 600 ms on and speaks again from 2 s on."""
    robot = Robot(config)
    robot.run(650)
    robot.references = False
    assert robot.run(2000).reason == "reference-lost"
    robot.references = True
    return robot


def modes(robot: Robot, until: int, **first: Any) -> dict[str, int]:
    """By mode, the first tick at which the robot was in it."""
    seen = dict[str, int]()
    while robot.tick < until:
        tick = robot.tick
        outputs = robot.step(**first)
        first = {}
        seen.setdefault(outputs.mode, tick)
    return seen


def resume(tick: int) -> msg.Resume:
    return msg.Resume(tick, 0)


@pytest.mark.parametrize(("seconds", "begins"), [(0.2, 2300), (1.0, 3100), (2.0, 4100)])
def test_it_resumes_so_long_after_its_inputs_are_back(seconds: float, begins: int) -> None:
    # The time is counted from 2.1 s, the next begin of a half cycle: 300 + k · 200.
    for config, first in ((AUTO, {}), (ALONE, {"resume": resume(2000)})):
        robot = stood(replace(config, team=replace(config.team, resume_after=seconds)))
        assert modes(robot, begins + 1, **first) == {STAND: 2000, WALK: begins}
        assert robot.state.mode == Mode(WALK, begins)
        assert robot.step().reason == ""
    assert modes(stood(ALONE), 5000) == {STAND: 2000}, "nobody has asked for it"


def test_inputs_that_fail_again_within_that_time_keep_it_standing() -> None:
    robot = stood(AUTO)
    for until, references in ((2401, True), (3000, False)):
        robot.references = references
        robot.run(until)
    robot.references = True
    assert modes(robot, 4200) == {STAND: 3000, WALK: 4100}


@pytest.mark.parametrize("config", [ALONE, AUTO], ids=["ALONE", "AUTO"])
def test_who_is_asked_to_stop_stands_until_it_is_asked_to_go_on(config: Config) -> None:
    robot = Robot(config)
    robot.run(1000)
    halts = robot.step(stop=SafeStop(1000, 0, "dog", False))
    assert (halts.mode, halts.reason) == (STOPPING, "stopped:dog")
    assert modes(robot, 5000) == {STOPPING: 1001, STAND: 1500}
    assert modes(robot, 6000, resume=resume(5000)) == {STAND: 5000, WALK: 5100}


@pytest.mark.parametrize(
    ("stop", "asked_at", "asked_anew"),
    [
        (2000, 1999, 8000),  # asked before the stop, arrived after it
        (0, 1999, 8000),  # who presses it does not know the time
        (1 << 41, 2000, 8001),  # a liar's: none in the future counts
    ],
)
def test_a_request_of_before_a_stop_counts_no_more(
    stop: int, asked_at: int, asked_anew: int
) -> None:
    robot = stood(ALONE)
    robot.step(stop=SafeStop(stop, 0, "dog", False))
    assert robot.state.mode == Mode(STAND, robot.state.mode.since, "stopped:dog")
    assert modes(robot, 8000, resume=resume(asked_at)) == {STAND: 2001}
    both = {"stop": SafeStop(8000, 0, "dog", False), "resume": resume(8000)}
    assert modes(robot, 8001, **both) == {STAND: 8000}, "of both in one tick the stop counts"
    assert modes(robot, 9200, resume=resume(asked_anew)) == (
        {STAND: 8001} if asked_anew <= 8000 else {STAND: 8001, WALK: 8100}
    )


@pytest.mark.parametrize("auto", [False, True])
def test_a_fall_or_an_emergency_stop_meanwhile_is_latched(auto: bool) -> None:
    lies = [{"state": tilted(tick, 1.2)} for tick in range(2000, 2000 + AGREES_MS + 1)]
    for stops, mode in ((lies, PASSIVE), ([{"estop": EStop(2000, 0, "dog")}], ESTOP)):
        robot = stood(AUTO if auto else ALONE)
        assert [robot.step(**stop).mode for stop in stops][-1] == mode
        after = 2000 + len(stops)
        assert modes(robot, 5000, resume=resume(after)) == {mode: after}


KEYS = {"team.robots": 3, "planner.kind": "none"}
RULES = ModeRules(load(None, {**KEYS, "world.mode": "realtime"}), "r1")
NOW, SINCE = 9000, 300  # tick; when r1 began to walk


def status(tick: int, mode: str, reason: str = "") -> Status:
    return Status(tick, 0, mode, reason, "", {}, {}, np.zeros(0), np.zeros(0))


def lost_of(since: int = SINCE, **statuses: Status) -> list[str]:
    """Why a robot that walks since a tick stops at `NOW`, hearing these of the others."""
    stops = RULES.stops(Mode(WALK, since), Inputs(standing(NOW)), statuses, reference_age=0)
    assert {stop.mode for stop in stops} <= {STOPPING}
    return [stop.reason for stop in stops]


STANDS, DAMPED = status(NOW, STAND, "peer-lost:r3"), status(NOW, PASSIVE, "fall")


@pytest.mark.parametrize(
    ("said", "since", "lost"),
    [
        (status(NOW - SILENCE_MS, WALK), SINCE, False),
        (status(NOW - SILENCE_MS - 1, WALK), SINCE, True),
        (status(NOW - 90, STAND, "reference-lost"), SINCE, True),
        (status(NOW - 90, STOPPING, "peer-lost:r3"), SINCE, True),
        (status(NOW - 90, STAND), SINCE, False),  # all stand before they walk
        (status(NOW - 90, PASSIVE, "fall"), SINCE, True),
        (status(NOW - 90, ESTOP, "estop:dog"), SINCE, True),
        (status(NOW - 90, "standing-up", "reset:ann"), SINCE, True),
        (STANDS, NOW - GRACE_MS, False),  # robots that walk again need not begin at once
        (STANDS, NOW - GRACE_MS - 1, True),
        (DAMPED, NOW - 1, True),
    ],
)
def test_whose_status_stops_the_others(said: Status, since: int, lost: bool) -> None:
    """Who has not spoken is not missed."""
    assert lost_of(since, r2=said, r3=status(NOW, WALK)) == (["peer-lost:r2"] if lost else [])
    assert lost_of(since, r3=status(NOW, WALK)) == []


def test_all_are_ready_once_each_has_said_so() -> None:
    stands, walks = status(NOW, STAND, "peer-lost:r1"), status(NOW, WALK)
    assert RULES.peers_ready({"r2": stands, "r3": walks}, NOW)
    assert not RULES.peers_ready({"r2": stands}, NOW), "r3 has not spoken"
    assert not RULES.peers_ready({"r2": stands, "r3": walks}, NOW + SILENCE_MS + 1)
    for other, reason in ((STOPPING, "peer-lost"), (PASSIVE, "fall"), (STAND, "balance-lost")):
        assert not RULES.peers_ready({"r2": stands, "r3": status(NOW, other, reason)}, NOW)
    assert ModeRules(load(None, KEYS), "r1").peers_ready({}, NOW), "lock-step hears no statuses"


def test_a_robot_stands_up_once_the_others_rest() -> None:
    since = NOW - 50
    stands, rises = status(NOW, STAND, "peer-lost:r1"), status(NOW, "standing-up", "reset:ann")
    assert not RULES.peers_rest({"r2": stands, "r3": status(NOW, WALK)}, NOW, since)
    assert RULES.peers_rest({"r2": stands, "r3": rises}, NOW, since)
    assert not RULES.peers_rest({"r2": stands}, NOW, since), "r3 may still speak"
    assert RULES.peers_rest({"r2": stands}, since + GRACE_MS + 1, since)


class Deaf:
    """An agent that hears nothing of its peers, and loses samples, for some ticks."""

    def __init__(self, agent: Any, begin: int, end: int) -> None:
        self._agent, self._deaf = agent, range(begin, end)

    def step(self, state: Any, inputs: Inputs) -> Any:
        if inputs.state.tick in self._deaf:
            inputs = Inputs(inputs.state, references=inputs.references)
        return self._agent.step(state, inputs)


def test_a_pair_that_had_lost_each_other_walks_and_plans_on_together() -> None:
    config = replace(CONFIG, team=replace(CONFIG.team, auto_resume=True))
    rollout = Rollout(config, simple_predictor(config), every_100_ms)
    rollout.agents["r2"] = Deaf(rollout.agents["r2"], 1000, 1500)  # type: ignore[assignment]
    found = {tick.tick: tick.outputs for tick in rollout.ticks(5000)}
    assert {o.mode for o in found[3499].values()} == {STAND}
    assert all(o.reason.startswith("peer-lost") for o in found[3499].values())
    assert {name: o.mode for name, o in found[3500].items()} == {"r1": WALK, "r2": WALK}
    assert {o.mode for o in found[4999].values()} == {WALK}
    used = {name: state.planning.planner.step for name, state in rollout.states.items()}
    assert set(used.values()) == {4960 // 40}
    assert not rollout.world.fallen()
