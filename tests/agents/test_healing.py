"""A robot that stood because an input was lost walks again: when, on whose word, and how fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from quadriga.agents.agent import Inputs, Outputs
from quadriga.agents.healing import (
    RAMP_MS,
    WORD_MS,
    Healing,
    change_event,
    may_resume,
    ramp,
    step_healing,
)
from quadriga.agents.modes import COMMANDED, LOSSES, STAND, STOPPING, WALK, Mode
from quadriga.agents.validate import AGREES_MS
from quadriga.identification.rollout import Rollout
from quadriga.shared.codes import HALTS, INPUT_LOST, RESUMED
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import EStop, Resume, SafeStop
from tests.agents.duet import CONFIG, asked, every_100_ms, simple_predictor
from tests.agents.lone_robot import ALONE, Robot, tilted

AUTO = replace(ALONE, team=replace(ALONE.team, auto_resume=True))
WHOLE_MS = round(1000 * ALONE.team.resume_after)
LOST = Mode(STAND, 1700, "reference-lost")


def healed(since: int, word: int = -1) -> Healing:
    return Healing(whole_since=since, word=word)


@pytest.mark.parametrize("reason", sorted(LOSSES))
def test_after_a_loss_it_may_go_on_once_all_has_been_whole_for_a_second(reason: str) -> None:
    mode = Mode(STAND, 1700, f"{reason}:r2")
    assert not may_resume(healed(2000), mode, 1999 + WHOLE_MS, auto=True, whole_ms=WHOLE_MS)
    assert may_resume(healed(2000), mode, 2000 + WHOLE_MS, auto=True, whole_ms=WHOLE_MS)
    assert not may_resume(healed(2000), mode, 2000 + WHOLE_MS, auto=False, whole_ms=WHOLE_MS)
    assert may_resume(healed(2000, word=1900), mode, 2000 + WHOLE_MS, auto=False, whole_ms=WHOLE_MS)
    assert not may_resume(
        healed(2000, word=1900), mode, 1901 + WORD_MS, auto=False, whole_ms=WHOLE_MS
    )


@pytest.mark.parametrize("reason", sorted(COMMANDED))
def test_after_a_stop_or_its_release_it_goes_on_only_when_told_to(reason: str) -> None:
    mode = Mode(STAND, 1700, f"{reason}:ann")
    assert not may_resume(healed(2000), mode, 2000 + WHOLE_MS, auto=True, whole_ms=WHOLE_MS)
    assert may_resume(healed(2000, word=1900), mode, 2000 + WHOLE_MS, auto=False, whole_ms=WHOLE_MS)


@pytest.mark.parametrize(
    "mode",
    [
        Mode("damping", 5, "fall"),
        Mode("damping", 5, "qp-infeasible"),
        Mode("estop", 5, "estop:reference-lost"),
        Mode(STAND, 5, "balance-lost"),
        Mode(STAND, 5),
        Mode(STOPPING, 5, "reference-lost"),
        Mode(WALK, 5),
    ],
)
def test_nothing_else_is_ever_healed(mode: Mode) -> None:
    assert not may_resume(healed(10, word=10), mode, 10 + WHOLE_MS, auto=True, whole_ms=WHOLE_MS)


def test_what_is_whole_for_less_counts_from_the_begin_again() -> None:
    healing = Healing()
    for tick in range(2000, 2900):
        healing = step_healing(healing, LOST, tick, whole_from=tick)
    assert healing.whole_since == 2000
    healing = step_healing(healing, LOST, 2900, whole_from=None, word=2899)
    assert healing == Healing(word=2900)
    healing = step_healing(healing, LOST, 2901, whole_from=3100)
    assert healing == Healing(whole_since=3100, word=2900)
    walks = step_healing(
        replace(healing, resumed=3000), Mode(WALK, 3000), 3000, whole_from=None, word=2990
    )
    assert walks == Healing(resumed=3000)


def test_references_rise_from_nothing_within_a_second() -> None:
    references = tuple(replace(asked(0.4), tick=tick) for tick in range(4000, 6000, 100))
    assert ramp(references, Healing(), 5000) is references
    followed = ramp(references, Healing(resumed=4500), 5000)
    speeds = {item.tick: item.vx for item in followed}
    assert (speeds[4000], speeds[4500]) == (0.0, 0.0)
    assert speeds[4500 + RAMP_MS // 2] == pytest.approx(0.2)
    assert followed[-1] is references[-1]


def test_loss_and_return_are_announced_by_name_and_nothing_else_is() -> None:
    walk, stopping = Mode(WALK, 300), Mode(STOPPING, 1101, "peer-lost:r2")
    lost = change_event(walk, stopping, 1101, "r1")
    assert lost is not None
    assert (lost.code, lost.robot, lost.kind) == (INPUT_LOST, "r1", "fault")
    assert lost.detail == "slows down and stands: peer-lost:r2"
    assert change_event(stopping, replace(stopping, name=STAND), 1700, "r1") is None
    back = change_event(LOST, Mode(WALK, 4100), 4100, "r1")
    assert back is not None
    assert (back.code, back.detail) == (RESUMED, "walks again after reference-lost")
    for after in (Mode(STOPPING, 5, "balance-lost"), Mode("damping", 5, "fall"), walk):
        assert change_event(Mode(STAND, 0), after, 5, "r1") is None


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


def test_by_itself_only_if_it_is_configured_so_and_at_the_begin_of_a_half_cycle() -> None:
    assert modes(stood(ALONE), 4000) == {"stand": 2000}
    robot = stood(AUTO)
    assert modes(robot, 4000) == {"stand": 2000, "walk": 3100}  # 300 + k · 200
    assert robot.state.mode == Mode(WALK, 3100)
    assert robot.step().reason == ""


@pytest.mark.parametrize(("seconds", "begins"), [(0.2, 2300), (2.0, 4100)])
def test_so_long_after_its_inputs_are_back_as_is_configured(seconds: float, begins: int) -> None:
    # The time is counted from 2.1 s, the next begin of a half cycle: 300 + k · 200.
    for config, words in ((AUTO, {}), (ALONE, {"resume": Resume(2000, 0)})):
        robot = stood(replace(config, team=replace(config.team, resume_after=seconds)))
        assert modes(robot, begins + 1, **words) == {"stand": 2000, "walk": begins}


def test_inputs_that_fail_again_within_that_time_keep_it_standing() -> None:
    robot = stood(AUTO)
    robot.run(2401)
    robot.references = False
    robot.run(3000)
    robot.references = True
    assert modes(robot, 4200) == {"stand": 3000, "walk": 4100}


def test_on_the_operators_word() -> None:
    robot = stood(ALONE)
    assert modes(robot, 4000, resume=Resume(2000, 0)) == {"stand": 2000, "walk": 3100}
    robot = stood(ALONE)
    robot.run(3500)
    assert modes(robot, 4000, resume=Resume(3500, 0)) == {"stand": 3500, "walk": 3700}


@pytest.mark.parametrize("config", [ALONE, AUTO], ids=["ALONE", "AUTO"])
def test_who_is_told_to_stop_stands_until_it_is_told_to_go_on(config: Config) -> None:
    robot = Robot(config)
    robot.run(1000)
    halts = robot.step(stop=SafeStop(1000, 0, "dog", False))
    assert (halts.mode, halts.reason) == (STOPPING, "stopped:dog")
    assert modes(robot, 5000) == {STOPPING: 1001, STAND: 1500}
    assert modes(robot, 6000, resume=Resume(5000, 0)) == {STAND: 5000, WALK: 5100}


def test_a_word_to_go_on_before_a_stop_counts_no_more() -> None:
    robot = stood(ALONE)
    robot.step(resume=Resume(2000, 0))
    robot.step(stop=SafeStop(2001, 0, "dog", False))
    assert robot.state.mode == Mode(STAND, robot.state.mode.since, "stopped:dog")
    assert modes(robot, 8000) == {STAND: 2002}
    both = {"stop": SafeStop(8000, 0, "dog", False), "resume": Resume(8000, 0)}
    assert modes(robot, 14000, **both) == {STAND: 8000}, "of both in one tick the stop counts"


def test_a_word_that_was_said_before_a_stop_and_comes_after_it_counts_no_more() -> None:
    robot = stood(ALONE)
    robot.step(stop=SafeStop(1995, 0, "dog", False))
    assert modes(robot, 8000, resume=Resume(1995, 0)) == {STAND: 2001}
    assert modes(robot, 12000, resume=Resume(1996, 0)) == {STAND: 8000, WALK: 8100}


def test_a_stop_of_who_does_not_know_the_time_outlasts_what_was_said_before_it() -> None:
    robot = stood(ALONE)
    robot.step(stop=SafeStop(0, 0, "dog", False))
    assert modes(robot, 8000, resume=Resume(1999, 0)) == {STAND: 2001}
    robot.step(stop=SafeStop(1 << 41, 0, "a liar's", False))
    assert modes(robot, 14000, resume=Resume(8001, 0)) == {STAND: 8001, WALK: 8100}


def test_a_stop_is_announced_as_what_it_is() -> None:
    told = change_event(Mode(WALK, 300), Mode(STOPPING, 900, "stopped:dog"), 900, "r1")
    assert told is not None
    assert (told.code, told.detail) == (HALTS, "slows down and stands: stopped:dog")


def test_a_word_while_all_is_well_is_forgotten() -> None:
    robot = Robot(ALONE)
    robot.run(500)
    robot.step(resume=Resume(500, 0))
    robot.run(650)
    robot.references = False
    robot.run(2000)
    robot.references = True
    assert robot.run(4000).mode == "stand"


def test_an_emergency_stop_is_for_good_however_soon_a_robot_may_go_on() -> None:
    robot = stood(replace(AUTO, team=replace(AUTO.team, resume_after=0.2)))
    assert robot.step(estop=EStop(2000, 0, "dog")).mode == "estop"
    assert modes(robot, 3000, resume=Resume(2001, 0)) == {"estop": 2001}


@pytest.mark.parametrize("auto", [False, True])
def test_a_fall_or_an_emergency_stop_meanwhile_is_for_good(auto: bool) -> None:
    lies = [{"state": tilted(tick, 1.2)} for tick in range(2000, 2000 + AGREES_MS + 1)]
    for stops, mode in ((lies, "damping"), ([{"estop": EStop(2000, 0, "dog")}], "estop")):
        robot = stood(AUTO if auto else ALONE)
        assert [robot.step(**stop).mode for stop in stops][-1] == mode
        after = 2000 + len(stops)
        assert modes(robot, 5000, resume=Resume(after, 0)) == {mode: after}


def pair(**team: Any) -> tuple[Rollout, Callable[[int], dict[str, Outputs]]]:
    """Two robots that plan with each other, and a function that lets them walk until a tick."""
    config = replace(CONFIG, team=replace(CONFIG.team, **team))
    rollout = Rollout(config, simple_predictor(config), every_100_ms)

    def run(until: int) -> dict[str, Outputs]:
        while rollout.world.tick < until:
            outputs = rollout.step().outputs
        return dict(outputs)

    return rollout, run


def deaf(agent: Any, begin: int, end: int) -> Any:
    """An agent that hears nothing of its peers, and loses samples, for some ticks."""

    class Deaf:
        def step(self, state: Any, inputs: Inputs) -> Any:
            if begin <= inputs.state.tick < end:
                inputs = Inputs(inputs.state, references=inputs.references)
            return agent.step(state, inputs)

    return Deaf()


def test_a_pair_that_had_lost_each_other_walks_and_plans_on_together() -> None:
    rollout, run = pair(auto_resume=True)
    rollout.agents["r2"] = deaf(rollout.agents["r2"], 1000, 1500)
    at_rest = run(3500)
    assert {o.mode for o in at_rest.values()} == {"stand"}
    assert all(o.reason.startswith("peer-lost") for o in at_rest.values())
    begun = run(3501)  # both at once
    assert {name: o.mode for name, o in begun.items()} == {"r1": "walk", "r2": "walk"}
    later = run(5000)
    assert {o.mode for o in later.values()} == {"walk"}
    used = {name: state.planning.planner.planner.step for name, state in rollout.states.items()}
    assert set(used.values()) == {4960 // 40}
    assert not rollout.world.fallen()
