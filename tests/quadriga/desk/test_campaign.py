"""Which walks a campaign on the desk makes, and how their rows are summed up."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from quadriga.desk.campaign import ROWS, has_failed, named_faults, read_rows
from quadriga.desk.faults import FAULTS, NO_FAULT
from quadriga.desk.tables import build_fault_table, build_walk_table
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import robot_names
from quadriga.sim_server.native.orders import parse_order


def test_faults_by_name_in_the_order_of_the_table() -> None:
    assert named_faults([]) == [NO_FAULT]
    assert named_faults(["all"]) == list(FAULTS)
    names = ["remote-stop", "none", "agent-killed"]
    assert [fault.name for fault in named_faults(names)] == ["none", "agent-killed", "remote-stop"]
    with pytest.raises(ConfigError, match=r"--fault: got 'remote', .*remote-stop"):
        named_faults(["remote"])


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_every_fault_is_one_that_the_desk_understands(fault: Any) -> None:
    assert fault.orders or fault.processes
    for order in fault.orders:
        parse_order(f"r2 {order}", robot_names(2))


def row(fault: str, seed: int, **fields: Any) -> dict[str, Any]:
    return {
        "fault": fault,
        "seed": seed,
        "fell": [],
        "figures": {},
        "late": {},
        "agents": {},
        **fields,
    }


def text_of(table: Any) -> str:
    out = StringIO()
    Console(file=out, width=300).print(table)
    return out.getvalue()


def cells(text: str, first: str) -> list[str]:
    line = next(line for line in text.splitlines() if first in line)
    return [cell.strip() for cell in line.strip("│").split("│")]


def test_faults_summed_up() -> None:
    stopped = {"r2": ["walking", "stopped command-late:51 ms"], "r1": ["walking", "limp"]}
    rows = [
        row("agent-killed", 1, robot="r2", fell=["r1"], rest_ms={"r2": 52}, said=stopped),
        row("agent-killed", 2, robot="r2", rest_ms={"r2": 54}, said=stopped),
        row("agent-killed", 3, error="the team: got nothing"),
        row("none", 4, robot="r1", said={}),
    ]
    text = text_of(build_fault_table(rows))
    expected = ["agent-killed", "3", "1", "0", "1", "2", "53", "54"]
    assert cells(text, "agent-killed") == [*expected, "stopped command-late (2)"]
    assert "none" not in text


def test_walks_summed_up_beside_those_without_bridges() -> None:
    answers = {"answer.median": 1.0, "answer.p99": 2.0, "answer.max": 3.0, "share": 0.1}
    ages = {"command.median": 0.0, "command.p99": 1.0, "command.max": 2.0, "share": 0.0}
    figures = {"vx": 0.5, "vy_rms": 0.01, "wz_rms": 0.02, "roll_rms": 0.003, "pitch_rms": 0.004}
    said = {"r1": ["walking", "stopped speed:RL"]}
    rows = [
        row("none", 1, figures={"r1": figures}, late={"r1": answers}, said=said),
        row("without-bridges", 1, figures={"r1": figures}, late={"r1": ages}),
    ]
    text = text_of(build_walk_table(rows))
    assert cells(text, "│ bridges")[1:5] == ["1", "0", "0", "1"]
    assert cells(text, "│ bridges")[5:10] == ["0.500", "10.0", "20.0", "3.00", "4.00"]
    assert cells(text, "│ bridges")[10:] == ["1.00", "2.00", "3.00", "10.0"]
    assert cells(text, "no bridges")[10:] == ["0.00", "1.00", "2.00", "0.0"]


def test_rows_are_kept_for_later(tmp_path: Path) -> None:
    assert read_rows(tmp_path) == []
    (tmp_path / ROWS).write_text(json.dumps(row("none", 1)) + "\n", encoding="utf-8")
    assert read_rows(tmp_path) == [row("none", 1)]


def test_a_fall_that_nobody_caused_and_a_walk_that_did_not_begin_are_failures() -> None:
    assert not has_failed(row("none", 1, robot=""))
    assert has_failed(row("none", 1, robot="", fell=["r1"]))
    assert has_failed(row("remote-stop", 1, robot="r2", fell=["r1", "r2"]))
    assert not has_failed(row("remote-stop", 1, robot="r2", fell=["r2"]))
    assert has_failed({"fault": "none", "seed": 1, "error": "the team: got nothing"})
