"""What was out of the ordinary before a fall is found where it was planted."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.report.conditions import COLUMNS
from quadriga.report.run import read_run
from quadriga.report.troubles import Sign, Trouble, find_troubles
from quadriga.shared import messages as msg
from quadriga.shared.messages import Command, Message, Plan, State, Status, Truth
from tests.a1 import TORQUE_LIMIT
from tests.quadriga.conftest import Change, WriteRun, run_config
from tests.quadriga.report.test_page import fallen

FALL = 1500
CONFIG = run_config(2, 1.6)


def write_short(
    write_run: WriteRun, change: Change = lambda _, message: message, **more: Any
) -> Path:
    """The run without commands, which would take most of the time and say nothing here."""
    return write_run(
        CONFIG, change=lambda k, m: None if isinstance(m, Command) else change(k, m), **more
    )


def find_only(folder: Path) -> Trouble:
    (trouble,) = find_troubles(read_run(folder / "run.mcap"))
    return trouble


def cell(trouble: Trouble, robot: str, column: str) -> tuple[str, bool]:
    condition = next(found for found in trouble.conditions if found.robot == robot)
    return condition.cells[COLUMNS.index(column)]


def signs(trouble: Trouble, robot: str) -> list[Sign]:
    return [sign for sign in trouble.signs if sign.robot == robot]


def test_a_fall_and_the_agents_word_on_it_are_one_trouble(write_run: WriteRun) -> None:
    trouble = find_only(write_short(write_run, extra=fallen(FALL)))
    assert (trouble.tick, trouble.robots) == (FALL, ("r2",))
    assert {entry.kind for entry in trouble.entries} == {"fall", "stopped"}
    assert len(trouble.conditions) == 2
    assert all(len(condition.cells) == len(COLUMNS) for condition in trouble.conditions)


def test_what_goes_on_after_the_fall_is_said_to(write_run: WriteRun) -> None:
    def change(key: str, message: Message) -> Message:
        if isinstance(message, Status) and "r1" in key:
            return replace(message, counters={"missed": message.tick // 100})
        return message

    trouble = find_only(write_short(write_run, change, extra=fallen(1300)))
    assert "counted: missed 15, until 1.50 s" in [sign.text for sign in signs(trouble, "r1")]


def test_troubles_far_apart_are_two_and_who_is_down_is_not_judged(write_run: WriteRun) -> None:
    extra = [*fallen(900, "r1"), *fallen(FALL, "r2")]
    first, second = find_troubles(read_run(write_short(write_run, extra=extra) / "run.mcap"))
    assert (first.tick, second.tick) == (900, FALL)
    assert second.conditions[0].cells == (("down since 0.90 s", False),)
    assert not signs(second, "r1")


def test_tilt_torque_and_a_foot_without_ground_are_found(write_run: WriteRun) -> None:
    def change(key: str, message: Message) -> Message:
        if isinstance(message, State) and key == "team/r2/state" and message.tick >= 1300:
            torque = message.tau_joint.copy()
            torque[4] = -TORQUE_LIMIT
            half = 0.15
            tilted = np.array([np.cos(half), np.sin(half), 0.0, 0.0])
            return replace(message, tau_joint=torque, imu_quat_wxyz=tilted)
        if isinstance(message, Truth) and 1310 <= message.tick < 1390:
            grf = message.grf.copy()
            grf[1, :, 2] = 0.0
            return replace(message, grf=grf)
        return message

    trouble = find_only(write_short(write_run, change, extra=fallen(FALL)))
    assert cell(trouble, "r2", "greatest tilt") == ("0.30 rad (17°)", True)
    assert cell(trouble, "r1", "greatest tilt") == ("0.00 rad (0°)", False)
    assert cell(trouble, "r2", "torque at most") == ("100 %", True)
    text, marked = cell(trouble, "r2", "stance without ground")
    assert marked
    assert "80 ms" in text
    found = {sign.text.partition(",")[0]: sign.tick for sign in signs(trouble, "r2")}
    assert found["tilts more than 0.25 rad"] == 1300
    assert found["a joint at its torque limit"] == 1300
    assert any("finds no ground" in text and tick == 1310 for text, tick in found.items())


def test_a_foot_that_slides_is_told_from_one_that_stands(write_run: WriteRun) -> None:
    # The closed-form robot's legs do not move, so at 0.51 m/s every loaded foot slides.
    def lifted(_key: str, message: Message) -> Message:
        if isinstance(message, Truth):
            grf = message.grf.copy()
            grf[0, :, 2] = 0.0
            return replace(message, grf=grf)
        return message

    trouble = find_only(write_short(write_run, lifted, extra=fallen(FALL)))
    text, marked = cell(trouble, "r2", "fastest slip")
    assert marked
    assert float(text.split()[0]) == pytest.approx(0.51, abs=0.02)
    assert cell(trouble, "r1", "fastest slip") == ("0.00 m/s, FL", False)


def test_a_strong_yoke_is_told_with_its_other_end(write_run: WriteRun) -> None:
    def pulled(_key: str, message: Message) -> Message:
        if isinstance(message, Truth) and message.tick == 1300:
            return replace(message, yoke_force=np.full_like(message.yoke_force, -90.0))
        return message

    trouble = find_only(write_short(write_run, pulled, extra=fallen(FALL)))
    text, marked = cell(trouble, "r2", "strongest yoke")
    assert re.fullmatch(r"r1 pulls with 90 N, 0\.\d\d s before", text)
    assert marked


def test_a_weak_yoke_is_nothing_unusual(write_run: WriteRun) -> None:
    trouble = find_only(write_short(write_run, extra=fallen(FALL)))
    assert cell(trouble, "r2", "strongest yoke")[1] is False


def test_plans_that_failed_aged_or_pushed_at_their_limits_are_found(write_run: WriteRun) -> None:
    def change(key: str, message: Message) -> Message | None:
        if not isinstance(message, Plan) or message.tick < 900:
            return message
        if key == "team/r1/plan":
            return None if message.tick > 1000 else message
        strong = message.u.copy()
        strong[:, 0] = 0.7 * strong[:, 2]
        return replace(
            message, status="nominal:infeasible", used={"r1": message.step - 4}, u=strong
        )

    trouble = find_only(write_short(write_run, change, extra=fallen(FALL)))
    text, marked = cell(trouble, "r2", "plans")
    assert marked
    assert "nominal:infeasible 15" in text
    assert cell(trouble, "r2", "oldest input") == ("plan.r1 160 ms", True)
    text, marked = cell(trouble, "r2", "planned force at a limit")
    assert marked
    assert text != "0 % of samples"
    assert cell(trouble, "r1", "plans")[0].endswith("the last 500 ms before")
    assert ("plan: nominal:infeasible, 17 plans, until 1.56 s", 920) in [
        (sign.text, sign.tick) for sign in signs(trouble, "r2")
    ]


def test_a_robot_that_makes_no_plan_is_named(write_run: WriteRun) -> None:
    def change(key: str, message: Message) -> Message | None:
        return None if key == "team/r1/plan" else message

    trouble = find_only(write_short(write_run, change, extra=fallen(FALL)))
    assert "makes no plan in this second" in [sign.text for sign in signs(trouble, "r1")]
    assert cell(trouble, "r1", "plans") == ("none", True)


def test_a_gap_in_the_sensors_and_a_push_are_signs(write_run: WriteRun) -> None:
    def change(key: str, message: Message) -> Message | None:
        return None if key == "team/r1/state" and 1000 <= message.tick < 1050 else message

    push = [("team/sim/event", msg.Event(800, 0, "push", "r2", "90 N", "push"))]
    trouble = find_only(write_short(write_run, change, extra=[*push, *fallen(FALL)]))
    gap = "gap: 50 messages of r1/state are missing"
    assert (1000, gap) in [(sign.tick, sign.text) for sign in signs(trouble, "r1")]
    assert (800, "push: 90 N") in [(sign.tick, sign.text) for sign in signs(trouble, "r2")]
