"""A status as lines, as a screen of any width, and as JSON that programs read."""

from __future__ import annotations

import json
import re
from io import StringIO

import pytest
from rich.console import Console

from quadriga.recordings.rates import RateFigures
from quadriga.shared.runtime.places import SOURCE
from quadriga.status.format import format_status, to_json
from quadriga.status.record import Account, Costs, MachineUse, MemberStatus, TeamReading, TeamStatus
from quadriga.status.screen import build_screen

AGES = {"reference": 40.0, "plan.r2": 80.0, "plan.r3": 40.0, "jitter.max": 3.0}
COSTS = Costs(0.2, 1.25, 3.0), Costs(132.0, 218.0, 300.0)
R1 = Account("walk", "", 20.0, AGES, *COSTS, {"states_passed_over": 3})
STATUS = TeamStatus(
    "team",
    "tcp/127.1.2.2:7447",
    True,
    TeamReading(
        12_340,
        0.98,
        {"r1": R1},
        (RateFigures("team/r1/plan", 1234, 25.0, 24.5, 1234),),
        {},
        {"r1": 0.25},
        ("8 ms: push r1 80 N",),
    ),
    (
        MemberStatus("r1", True, "well", MachineUse("lab", 4711, 0.31, 280_000_000), R1),
        MemberStatus("r2", False, "not well: gone"),
    ),
    ("r2: not well: gone",),
)


def test_lines_tell_all() -> None:
    text = "\n".join(format_status(STATUS))
    assert text.startswith("team 'team' at tcp/127.1.2.2:7447: 12.34 s, 0.98 × real time\n")
    (row,) = re.findall("^  r1 .*", text, re.MULTILINE)
    for cell in ("walk", "0.20 / 1.25", "132 / 218", "plan 80, reference 40", "31%", "280"):
        assert cell in row
    assert re.search(r"team/r1/plan +25.0 +24.5 +1,234", text)
    assert "late commands: r1 25.0% (too many)" in text
    assert "8 ms: push r1 80 N" in text
    assert text.endswith("wrong: r2: not well: gone")


@pytest.mark.parametrize("width", [60, 80, 120, 200])
def test_a_screen_of_any_width_shows_all_numbers(width: int) -> None:
    console = Console(width=width, file=StringIO(), record=True)
    console.print(build_screen(STATUS, width))
    text = console.export_text()
    assert max(map(len, text.splitlines())) <= width
    for cell in ("0.20 / 1.25", "132 / 218", "31%", "280", "25.0", "24.5", "1,234", "12.34 s"):
        assert cell in text
    assert "wrong: r2: not well: gone" in text


def test_json_is_one_line_that_programs_read() -> None:
    text = to_json(STATUS)
    body = json.loads(text)
    assert "\n" not in text
    assert (body["format"], body["well"], body["tick"], body["pace"]) == (1, False, 12_340, 0.98)
    r1, r2 = body["members"]
    assert r1["use"] == {"host": "lab", "pid": 4711, "cpu": 0.31, "memory": 280_000_000}
    assert r1["account"]["planner_ms"] == {"median": 0.2, "p99": 1.25, "max": 3.0}
    assert r1["account"]["counters"] == {"states_passed_over": 3}
    assert (r2["use"], r2["account"], r2["health"]) == (None, None, "not well: gone")
    assert body["topics"][0]["lost"] == 1234
    assert body["problems"] == ["r2: not well: gone"]


def test_every_field_is_documented() -> None:
    page = (SOURCE / "docs" / "status.md").read_text(encoding="utf-8")
    body = json.loads(to_json(STATUS))
    names = {*body, *body["members"][0], *body["members"][0]["account"], *body["topics"][0]}
    assert [name for name in sorted(names) if f"`{name}`" not in page] == []
