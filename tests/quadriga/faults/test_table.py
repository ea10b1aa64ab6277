from typing import Any

from quadriga.faults.campaign import describe_row
from quadriga.faults.table import build_team_fault_table

WALKS = {"r1": "walk", "r2": "walk"}
STOOD = {"r1": "stand peer-lost:r2", "r2": "walk"}


def row(**fields: Any) -> dict[str, Any]:
    return {
        "fault": "agent-killed",
        "seed": 1,
        "robot": "r2",
        "tick": 3000,
        "falls": [],
        "lowered": [],
        "falls_of_others": 0,
        "detect_ms": None,
        "stand_ms": None,
        "lost_messages": 0,
        "status": WALKS,
        "end": "time-over: end of world.seconds",
    } | fields


def test_a_line_for_each_fault_with_what_came_of_it() -> None:
    rows = [
        row(),
        row(status=STOOD, detect_ms=60, stand_ms=300, lost_messages=4),
        row(lowered=["r2"], detect_ms=80, stand_ms=400, status={"r1": STOOD["r1"], "r2": "walk"}),
        row(falls=["r1", "r2"], falls_of_others=1, end="fallen: fall of r1", detect_ms=100),
        {"fault": "agent-killed", "seed": 5, "error": "the team: got no walk"},
        row(fault="imu-stuck"),
        row(fault="message-forged", forged=220, refused=219, passed=1),
        row(fault="message-forged", forged=220, refused=220, passed=0),
    ]
    table = build_team_fault_table(rows)
    lines = {line[0]: dict(zip(table.columns, line, strict=True)) for line in table.rows}
    assert list(lines) == ["agent-killed", "imu-stuck", "message-forged"]
    attack = [[line[name] for name in ("forged", "refused", "passed")] for line in lines.values()]
    assert attack == [["–"] * 3, ["–"] * 3, ["440", "439", "1"]]
    killed = lines["agent-killed"]
    assert (killed["tries"], killed["no result"], killed["walked on"]) == ("5", "1", "1")
    assert (killed["stopped"], killed["falls"], killed["falls of others"]) == ("2", "1", "1")
    assert (killed["noticed ms p50"], killed["lost messages"]) == ("80", "4")
    assert table.rows[0][8:11] == ("100", "350", "400")
    assert killed["most frequent reason"] == "peer-lost (2)"
    assert lines["imu-stuck"]["noticed ms p50"] == lines["imu-stuck"]["most frequent reason"][0]


def test_who_is_led_down_has_not_walked_on() -> None:
    table = build_team_fault_table([row(lowered=["r2"], detect_ms=15)])
    cells = dict(zip(table.columns, table.rows[0], strict=True))
    assert (cells["walked on"], cells["stopped"]) == ("0", "1")
    assert "led down: r2" in describe_row(row(lowered=["r2"]))


def test_a_walk_in_one_line() -> None:
    text = describe_row(row(status=STOOD, detect_ms=60, stand_ms=300))
    assert text == (
        "at r2, 3.00 s; fell: none; noticed after 60 ms; others stood after 300 ms; "
        "r1: stand peer-lost:r2"
    )
    assert describe_row({"fault": "x", "seed": 1, "error": "a\nb"}) == "no result: a"
