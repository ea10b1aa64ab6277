"""`quadriga info --check`: a good recording passes, a broken rule is found at its message."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadriga.commands.parser import main
from quadriga.recordings.check import check, format_findings
from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.recordings.checks.sequence import Order
from quadriga.recordings.summary import summarise
from quadriga.shared import messages as msg
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import (
    Config,
    IdentificationConfig,
    PlannerConfig,
    TeamConfig,
    WorldConfig,
)
from quadriga.shared.recording.writer import RecordingWriter
from tests.plugins.kinds import install_kind
from tests.quadriga.conftest import WriteRun, run_config, write

SHORT = run_config(seconds=1.3)
AT = 1200  # a tick at which everything is sent
STEP = AT // 40
Change = Callable[[str, msg.Message], msg.Message | bytes | None]


def at(key: str, alter: Callable[[msg.Message], msg.Message | bytes | None]) -> Change:
    """A change of the one message on `key` at tick `AT`."""
    return lambda k, message: alter(message) if (k, message.tick) == (key, AT) else message


def tau(torque: float) -> Callable[[msg.Message], msg.Message]:
    def alter(message: msg.Message) -> msg.Message:
        assert isinstance(message, msg.Command)
        return replace(message, tau=np.full(12, torque))

    return alter


def gains(kp: float, kd: float) -> Callable[[msg.Message], msg.Message]:
    def alter(message: msg.Message) -> msg.Message:
        assert isinstance(message, msg.Command)
        return replace(message, kp=np.full(12, kp), kd=np.full(12, kd))

    return alter


def force(sample: int, column: int, value: float) -> Callable[[msg.Message], msg.Message]:
    def alter(message: msg.Message) -> msg.Message:
        assert isinstance(message, msg.Plan)
        u = message.u.copy()
        u[sample, column] = value
        return replace(message, u=u)

    return alter


def plan(**changes: object) -> Callable[[msg.Message], msg.Message]:
    def alter(message: msg.Message) -> msg.Message:
        assert isinstance(message, msg.Plan)
        return replace(message, **changes)  # type: ignore[arg-type]

    return alter


def aged(plan_ms: float) -> Callable[[msg.Message], msg.Message]:
    def alter(message: msg.Message) -> msg.Message:
        assert isinstance(message, msg.Status)
        return replace(message, ages_ms={"plan.r1": plan_ms, "reference": 500.0})

    return alter


def by_name(findings: list[Finding]) -> dict[str, Finding]:
    return {finding.name: finding for finding in findings}


def failed(findings: list[Finding]) -> set[str]:
    return {finding.name for finding in findings if not finding.passed}


def test_a_good_recording_passes(known_run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "--check", str(known_run / "run.mcap")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines] == [
        ["ok", name]
        for name in (
            "whole",
            "schema",
            "log",
            "order",
            "gaps",
            "delay",
            "friction",
            "torques",
            "ages",
            "end",
        )
    ]


# At step 30 (tick 1200, 900 ms after the initial stand) FL and RR of r1 stand, FR and RL swing.
@pytest.mark.parametrize(
    ("change", "name", "got", "limit"),
    [
        (at("team/r1/command", lambda _: b"\x81"), "schema", "command 1 bytes", "a MessagePack"),
        (
            at("team/r1/command", lambda m: replace(m, tick=AT - 5)),
            "order",
            "tick 1195 after 1199",
            "a later tick",
        ),
        (at("team/r1/state", lambda _: None), "gaps", "1 missing after tick 1199", "every 1 ms"),
        (at("team/r2/plan", plan(used={"r1": STEP})), "delay", "step 30 of r1", "step 29"),
        (at("team/r2/plan", plan(used={"r1": STEP - 2})), "delay", "step 28 of r1", "which was"),
        (at("team/r2/plan", plan(used={})), "delay", "used none of r1", "step 29"),
        (at("team/r2/plan", plan(used={"r2": 29})), "delay", "used a plan of r2", "of r1"),
        (at("team/r2/plan", plan(exchange=1, used={"r1": 30})), "delay", "exchange 1", "at most 0"),
        (
            at("team/r1/plan", force(0, 3, 1e-3)),
            "friction",
            "fx 0.001 N of FR at sample 0",
            "0 of a swing leg",
        ),
        (at("team/r1/plan", force(0, 1, -40.0)), "friction", "fy -40 N of FL", "0.4243 · fz"),
        (
            at("team/r1/plan", force(3, 2, -0.5)),
            "friction",
            "fz -0.5 N of FL at sample 3",
            "at least 0 N",
        ),
        (at("team/r2/command", tau(33.6)), "torques", "33.6 N·m of FL_hip", "33.5 N·m"),
        (at("team/r2/command", gains(80.0, 0.0)), "torques", "kp up to 80", "no kp, kd"),
        (at("team/r2/command", gains(0.0, 3.0)), "torques", "kd up to 3", "no kp, kd"),
        (at("team/r2/status", aged(400.0)), "ages", "plan.r1 400 ms old", "360 ms"),
        (
            lambda k, m: None if k == "team/reference" and 500 < m.tick < 1100 else m,
            "ages",
            "600 ms since",
            "500 ms",
        ),
        (lambda k, m: None if k == "team/r2/measurement" else m, "gaps", "no message at all", ""),
        (lambda k, m: None if "/r" in k else m, "gaps", "no message at all", ""),
        (
            lambda k, m: None if k == "team/r2/command" and m.tick > AT else m,
            "gaps",
            "none after tick 1200",
            "until tick 1300",
        ),
    ],
)
def test_every_broken_rule_is_found_at_its_message(
    write_run: WriteRun, change: Change, name: str, got: str, limit: str
) -> None:
    findings = check(write_run(SHORT, change=change) / "run.mcap")
    assert name in failed(findings)
    finding = by_name(findings)[name]
    first = finding.first[0]
    assert got in first.got
    assert limit in first.limit
    assert any(first.got in line and "FAIL" not in line for line in format_findings(findings))


@pytest.mark.parametrize("own", [False, True])
def test_events_of_robots_with_plants_of_their_own_are_in_order_each(own: bool) -> None:
    order = Order(replace(SHORT, team=replace(SHORT.team, plant_per_robot=own)))
    for tick, robot in ((20, "r1"), (15, "r2"), (30, "r2")):
        event = msg.Event.of(tick, "bridge-mode", robot, "walking")
        order.look(CheckedMessage("team/sim/event", "", "sim/event", event))
    assert order.finding.passed == own
    order.look(
        CheckedMessage(
            "team/sim/event", "", "sim/event", msg.Event.of(25, "bridge-mode", "r2", "stopped")
        )
    )
    assert not order.finding.passed


def test_tolerances_are_a_millionth_of_a_newton(write_run: WriteRun) -> None:
    change = at("team/r1/plan", force(0, 3, 0.9e-6))
    assert failed(check(write_run(SHORT, change=change) / "run.mcap")) == set()


def test_a_plan_that_is_held_is_no_older_than_it_may_be(write_run: WriteRun) -> None:
    """Of the step before, shifted by three steps, held for five: 9 · 40 ms."""
    change = at("team/r2/status", aged(360.0))
    assert failed(check(write_run(SHORT, change=change) / "run.mcap")) == set()


def test_a_status_that_gave_up_waiting_excuses_an_older_plan(write_run: WriteRun) -> None:
    def change(key: str, message: msg.Message) -> msg.Message:
        if key == "team/r2/status":
            assert isinstance(message, msg.Status)
            return replace(message, counters={"waits_given_up": 1})
        return at("team/r2/plan", plan(used={"r1": STEP - 2}))(key, message)  # type: ignore[return-value]

    findings = by_name(check(write_run(SHORT, change=change) / "run.mcap"))
    assert findings["delay"].passed
    assert "1 older plans of peers used" in findings["delay"].notes[0]


def plans_only(folder: Path, config: Config, plans: list[tuple[str, msg.Plan]]) -> Finding:
    """The finding on the delay of a recording that holds nothing but plans."""
    from quadriga.recordings.metadata import build_metadata

    path = folder / "plans.mcap"
    with RecordingWriter(path, build_metadata(config, "")) as writer:
        for robot, each in plans:
            writer.write(f"team/{robot}/plan", encode(each), 1)
    return by_name(check(path))["delay"]


def bare(step: int, exchange: int, used: dict[str, int], status: str = "solved") -> msg.Plan:
    return msg.Plan(
        40 * step,
        40_000_000 * step,
        step,
        np.zeros((25, 12)),
        np.zeros((25, 6)),
        status,
        used,
        exchange,
    )


@pytest.mark.parametrize("responds", [True, False])
def test_plans_of_a_plugin_are_held_against_the_delay_by_its_facts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, responds: bool
) -> None:
    kind = "responsive" if responds else "aloof"
    install_kind(tmp_path, monkeypatch, kind, f"'nowhere:P', needs_peers={responds}")
    config = Config(team=TeamConfig(robots=2), planner=PlannerConfig(kind=kind))
    plans = [(f"r{i}", bare(step, 0, {})) for step in (20, 21) for i in (1, 2)]
    finding = plans_only(tmp_path, config, plans)
    assert finding.passed is not responds
    assert [first.got for first in finding.first] == (
        ["used none of r2", "used none of r1"] if responds else []
    )
    (tmp_path / "plans.mcap").unlink()
    plans[-1] = ("r2", bare(21, 0, {"r1": 20}))
    finding = plans_only(tmp_path, config, plans)
    expected = "used none of r2" if responds else "used a plan of r1"
    assert [first.got for first in finding.first] == [expected]


def test_answers_within_a_step_use_the_plans_of_that_step(tmp_path: Path) -> None:
    config = Config(
        team=TeamConfig(robots=2), planner=PlannerConfig(exchanges=1, compensation=True)
    )
    good = [
        (robot, bare(step, exchange, {peer: step if exchange else step - 1}))
        for step in (20, 21)
        for exchange in (0, 1)
        for robot, peer in (("r1", "r2"), ("r2", "r1"))
    ]
    assert plans_only(tmp_path, config, good).passed
    (tmp_path / "plans.mcap").unlink()
    late = [*good[:-1], ("r2", bare(21, 1, {"r1": 20}))]
    finding = plans_only(tmp_path, config, late)
    assert [o.got for o in finding.first] == ["used step 20 of r1"]
    (tmp_path / "plans.mcap").unlink()
    invented = [*good, ("r2", bare(23, 0, {"r1": 22}))]
    finding = plans_only(tmp_path, config, invented)
    assert [o.got for o in finding.first] == ["used step 22 of r1, which is not recorded"]


def test_other_planners_have_other_rules(tmp_path: Path) -> None:
    def passes(config: Config, *plans: tuple[str, msg.Plan]) -> bool:
        (tmp_path / "plans.mcap").unlink(missing_ok=True)
        return plans_only(tmp_path, config, list(plans)).passed

    central = Config(team=TeamConfig(robots=2), planner=PlannerConfig(kind="deepc"))
    assert passes(central, ("r1", bare(20, 0, {"r1": 20, "r2": 20})))
    assert not passes(central, ("r1", bare(20, 0, {"r1": 20, "r2": 19})))
    alone = Config(team=TeamConfig(robots=2), planner=PlannerConfig(kind="decentralised"))
    assert passes(alone, ("r1", bare(20, 0, {})))
    assert not passes(alone, ("r1", bare(20, 0, {"r2": 19})))
    chain = Config(
        team=TeamConfig(robots=3, yokes="chain"),
        identification=IdentificationConfig(neighbours="yoked"),
    )
    assert passes(chain, ("r1", bare(20, 0, {"r2": 19})))
    assert not passes(chain, ("r1", bare(20, 0, {"r2": 19, "r3": 19})))
    cooperative = Config(
        team=TeamConfig(robots=4, yokes="chain"),
        planner=PlannerConfig(cost="team", exchanges=8),
        identification=IdentificationConfig(neighbours="yoked"),
    )
    ahead = [(f"r{k}", bare(19, 0, {})) for k in (2, 3, 4)]

    def follows(*peers: str) -> bool:
        return passes(cooperative, *ahead, ("r1", bare(20, 0, dict.fromkeys(peers, 19))))

    assert follows("r2", "r3"), "its neighbour, and the one that counts in the neighbour's cost"
    assert not follows("r2")
    assert not follows("r2", "r3", "r4")
    late = Config(team=TeamConfig(robots=2), world=WorldConfig(mode="realtime"))
    before = [("r2", bare(step, 0, {})) for step in range(10, 25)]
    assert passes(late, *before, ("r1", bare(20, 0, {"r2": 17})))
    assert not passes(late, *before, ("r1", bare(20, 0, {"r2": 10})))
    assert passes(late, *before, ("r1", bare(20, 0, {"r2": 10}, "nominal:peer-lost")))


def test_real_time_agents_may_pass_over_ticks_but_the_world_may_not(tmp_path: Path) -> None:
    config = replace(SHORT, world=replace(SHORT.world, mode="realtime"))

    def change(key: str, message: msg.Message) -> msg.Message | None:
        passed_over = key == "team/r1/command" and message.tick in (700, 701)
        return None if passed_over else message

    findings = by_name(check(write(tmp_path / "a", config, change=change) / "run.mcap"))
    assert findings["gaps"].passed
    assert findings["gaps"].notes == ["2 passed over by agents in real time"]
    gone = at("team/r1/state", lambda _: None)
    findings = by_name(check(write(tmp_path / "b", config, change=gone) / "run.mcap"))
    assert findings["gaps"].objections == 1


@pytest.mark.parametrize("says_so", [True, False])
def test_robots_that_stand_for_a_while_owe_no_plans(tmp_path: Path, says_so: bool) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        rests = 800 <= message.tick < 1000
        if rests and says_so and isinstance(message, msg.Status):
            return replace(message, mode="stand", reason="stopped:ann")
        return None if rests and isinstance(message, msg.Plan) else message

    run = write(tmp_path, SHORT, change=change)
    findings = by_name(check(run / "run.mcap"))
    assert findings["gaps"].objections == (0 if says_so else 10)
    assert summarise(run)["gaps"] == (0 if says_so else 10)


def test_a_damaged_file_fails_and_the_rest_is_checked(
    known_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = bytearray((known_run / "run.mcap").read_bytes())
    content[content.index(b"lz4", len(content) // 2) + 100] ^= 1
    (tmp_path / "run.mcap").write_bytes(content)
    assert main(["info", "--check", str(tmp_path / "run.mcap")]) == 1
    out = capsys.readouterr().out
    assert re.match(r"FAIL  whole +[\d,]+ of 26,264 messages missing", out)
    assert "its checksum is wrong" in out
    assert "ok    schema" in out
