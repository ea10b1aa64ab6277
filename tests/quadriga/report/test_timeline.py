"""What happened is told once, with its time and for as long as it lasted."""

from __future__ import annotations

from dataclasses import replace

from quadriga.report.about import list_changed_keys
from quadriga.report.run import read_run
from quadriga.report.timeline import TimelineEntry
from quadriga.shared.config.load import load
from quadriga.shared.messages import Command, Message, Plan, State, Status
from tests.quadriga.conftest import Change, WriteRun, run_config

CONFIG = run_config(1, 1.2)


def entries(
    write_run: WriteRun, change: Change = lambda _, message: message
) -> list[TimelineEntry]:
    folder = write_run(CONFIG, change=lambda k, m: None if isinstance(m, Command) else change(k, m))
    return list(read_run(folder / "run.mcap").timeline)


def test_an_undisturbed_walk_has_little_to_tell(write_run: WriteRun) -> None:
    assert entries(write_run) == [
        TimelineEntry(300, 300, "r1", "mode", "begins to walk"),
        TimelineEntry(1000, 1000, "r1", "counted", "qp_fallback 1"),
    ]


def test_spells_of_plans_are_one_entry_each(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message:
        if isinstance(message, Plan) and message.tick in (480, 520, 560, 800):
            return replace(message, status="faded" if message.tick < 600 else "nominal:x")
        return message

    found = [entry for entry in entries(write_run, change) if entry.kind == "plan"]
    assert found == [
        TimelineEntry(480, 600, "r1", "plan", "faded, 3 plans", "faded"),
        TimelineEntry(800, 840, "r1", "plan", "nominal:x, 1 plan", "nominal"),
    ]


def test_a_stop_is_told_with_its_reason_and_asks_for_an_explanation(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message:
        if isinstance(message, Status) and message.tick >= 800:
            mode = "stopping" if message.tick < 1000 else "stand"
            return replace(message, mode=mode, reason="reference-lost")
        return message

    found = entries(write_run, change)
    (stop,) = [entry for entry in found if entry.trouble]
    text, code = "reference-lost (stopping)", "reference-lost"
    assert stop == TimelineEntry(800, 800, "r1", "stopped", text, code)
    assert TimelineEntry(1000, 1000, "r1", "mode", "stand") in found


def test_counts_that_follow_each_other_are_summed_up(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message:
        if not isinstance(message, Status):
            return message
        count = sum(n for tick, n in ((400, 2), (500, 3), (1100, 1)) if message.tick >= tick)
        usual = {"plan_faded": count, "qp_constrained": count}
        return replace(message, counters={"dropped_plan": count, **usual})

    found = [entry for entry in entries(write_run, change) if entry.kind == "counted"]
    assert [(m.tick, m.stop, m.text) for m in found] == [
        (400, 500, "dropped_plan 5"),
        (1100, 1100, "dropped_plan 1"),
    ]


def test_a_stretch_without_messages_is_a_gap_and_a_single_one_is_not(write_run: WriteRun) -> None:
    def change(_key: str, message: Message) -> Message | None:
        lost = message.tick == 200 or 700 <= message.tick < 730
        return None if isinstance(message, State) and lost else message

    found = [entry for entry in entries(write_run, change) if entry.kind == "gap"]
    assert found == [TimelineEntry(700, 730, "r1", "gap", "30 messages of r1/state are missing")]


def test_keys_that_are_not_at_their_defaults_are_told_with_unit_and_meaning() -> None:
    config = load(None, {"world.friction": 0.5, "planner.R": [1, 1, 1], "bus.mode": "client"})
    assert list_changed_keys(config) == [
        ("world.friction", "0.5", "0.8", "friction coefficient of feet on ground"),
        ("planner.R", "1, 1, 1", "0.2, 0.2, 0.05", "weights of fx, fy, fz"),
    ]
    assert list_changed_keys(load(None, {})) == []
