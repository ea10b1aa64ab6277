"""What happened is told once, with its time and for as long as it lasted."""

from __future__ import annotations

from dataclasses import replace

from quadriga.report.about import not_usual
from quadriga.report.moments import Moment
from quadriga.report.run import read_run
from quadriga.shared.config.load import load
from quadriga.shared.wire.messages import Command, Message, Plan, State, Status
from tests.quadriga.conftest import Change, WriteRun, run_config

CONFIG = run_config(1, 1.2)


def moments(write_run: WriteRun, change: Change = lambda _, message: message) -> list[Moment]:
    folder = write_run(CONFIG, change=lambda k, m: None if isinstance(m, Command) else change(k, m))
    return list(read_run(folder / "run.mcap").moments)


def test_an_undisturbed_walk_has_little_to_tell(write_run: WriteRun) -> None:
    assert moments(write_run) == [
        Moment(300, 300, "r1", "mode", "begins to walk"),
        Moment(1000, 1000, "r1", "counted", "qp_fallback 1"),
    ]


def test_spells_of_plans_are_one_moment_each(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message:
        if isinstance(message, Plan) and message.tick in (480, 520, 560, 800):
            return replace(message, status="faded" if message.tick < 600 else "nominal:x")
        return message

    found = [moment for moment in moments(write_run, change) if moment.kind == "plan"]
    assert found == [
        Moment(480, 600, "r1", "plan", "faded, 3 plans"),
        Moment(800, 840, "r1", "plan", "nominal:x, 1 plan"),
    ]


def test_a_stop_is_told_with_its_reason_and_asks_for_an_explanation(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message:
        if isinstance(message, Status) and message.tick >= 800:
            mode = "stopping" if message.tick < 1000 else "stand"
            return replace(message, mode=mode, reason="reference-lost")
        return message

    found = moments(write_run, change)
    (stop,) = [moment for moment in found if moment.trouble]
    assert stop == Moment(800, 800, "r1", "stopped", "reference-lost (stopping)")
    assert Moment(1000, 1000, "r1", "mode", "stand") in found


def test_counts_that_follow_each_other_are_summed_up(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message:
        if not isinstance(message, Status):
            return message
        count = sum(n for tick, n in ((400, 2), (500, 3), (1100, 1)) if message.tick >= tick)
        usual = {"plan_faded": count, "qp_constrained": count}
        return replace(message, counters={"dropped_plan": count, **usual})

    found = [moment for moment in moments(write_run, change) if moment.kind == "counted"]
    assert [(m.tick, m.stop, m.text) for m in found] == [
        (400, 500, "dropped_plan 5"),
        (1100, 1100, "dropped_plan 1"),
    ]


def test_a_stretch_without_messages_is_a_gap_and_a_single_one_is_not(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message | None:
        lost = message.tick == 200 or 700 <= message.tick < 730
        return None if isinstance(message, State) and lost else message

    found = [moment for moment in moments(write_run, change) if moment.kind == "gap"]
    assert found == [Moment(700, 730, "r1", "gap", "30 messages of r1/state are missing")]


def test_keys_that_are_not_at_their_defaults_are_told_with_unit_and_meaning() -> None:
    config = load(None, {"world.friction": 0.5, "planner.R": [1, 1, 1], "bus.mode": "client"})
    assert not_usual(config) == [
        ("world.friction", "0.5", "0.8", "friction coefficient of feet on ground"),
        ("planner.R", "1, 1, 1", "0.2, 0.2, 0.05", "weights of fx, fy, fz"),
    ]
    assert not_usual(load(None, {})) == []
