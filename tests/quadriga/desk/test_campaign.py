"""Which walks a campaign on the desk makes, and how their rows are summed up."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.desk.campaign import has_failed, named_faults
from quadriga.desk.faults import BY_NAME, FAULTS, NO_FAULT
from quadriga.desk.page import PUBLISHED, to_markdown
from quadriga.desk.tables import build_fault_table, build_walk_table, is_too_slow, outcome_of
from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.places import SOURCE
from quadriga.shared.unitree.codecs import A1
from quadriga.shared.unitree.udp import Address
from quadriga.sim_server.emulator.process import execute
from quadriga.sim_server.emulator.robot_emulator import UdpEmulator
from quadriga.tables import Table
from quadriga.team.trial_rows import ROWS, keep_config, read_rows
from tests.bridges.test_udp_driver import HOST, free_port

THROUGH = ("bridges", "no bridges")


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
    robot = UdpEmulator(A1, Address(HOST, free_port()))
    for order in fault.orders:
        assert execute(f"r2 {order}", {"r2": robot}) == f"r2 {order}"
    robot.close()


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


def cells(table: Table, name: str) -> dict[str, str]:
    """The row of this name, by heading."""
    return next(
        dict(zip(table.columns, line, strict=True)) for line in table.rows if line[0] == name
    )


ON = "time-over: end of world.duration; late ticks: r1 5"
OUTCOMES = (
    ("walked on", {"end": ON, "said": {"r1": ["walk", "lying-down"]}, "rest_ms": {"r1": 8000}}),
    ("lay down", {"end": "none", "said": {"r1": ["lying-down"]}, "rest_ms": {"r1": 3000}}),
    ("damped", {"end": ON, "said": {"r1": ["walk"]}, "rest_ms": {"r1": 70}}),
    ("still driven", {"end": "none", "said": {"r1": ["walk"]}, "rest_ms": {"r1": None}}),
)


@pytest.mark.parametrize(("outcome", "fields"), OUTCOMES, ids=[name for name, _ in OUTCOMES])
def test_what_became_of_a_robot(outcome: str, fields: dict[str, Any]) -> None:
    assert outcome_of(row("agent-killed", 1, **fields), "r1") == outcome


def test_faults_summed_up() -> None:
    said = {"r2": ["walk", "estop command-late:51 ms"], "r1": ["walk", "lying-down", "limp"]}
    end = {"end": "fallen: fall of r2"}
    rests = [{"r1": 4000, "r2": 52}, {"r1": 4000, "r2": 54}]
    rows = [
        row("agent-killed", 1, robot="r2", fell=["r1"], rest_ms=rests[0], said=said, **end),
        row("agent-killed", 2, robot="r2", rest_ms=rests[1], said=said, **end),
        row("agent-killed", 3, error="the team: got nothing"),
        row("none", 4, robot="r1", said={}),
    ]
    table = build_fault_table(rows)
    assert len(table.rows) == 1
    found = cells(table, "agent-killed")
    assert (found["tries"], found["no walk"], found["damped"], found["fell"]) == (
        "3",
        "1",
        "2",
        "0",
    )
    assert (found["ms to damping p50"], found["max"]) == ("53", "54")
    assert (found["others lay down"], found["others fell"]) == ("2", "1")
    assert found["its bridge's last word"] == "estop command-late (2)"


def test_walks_summed_up_beside_those_without_bridges() -> None:
    answers = {"answer.median": 1.0, "answer.p99": 2.0, "answer.max": 3.0, "share": 0.1}
    ages = {"command.median": 0.0, "command.p99": 1.0, "command.max": 2.0, "share": 0.0}
    figures = {"vx": 0.5, "vy_rms": 0.01, "wz_rms": 0.02, "roll_rms": 0.003, "pitch_rms": 0.004}
    said = {"r1": ["walk", "estop speed:RL"]}
    rows = [
        row("none", 1, figures={"r1": figures}, late={"r1": answers}, said=said),
        row("none", 2, figures={"r1": answers}, late={"r1": ages}, fell=["r1"], kept=0.97),
        row("without-bridges", 1, figures={"r1": figures}, late={"r1": ages}),
    ]
    table = build_walk_table(rows, "2 A1: ")
    bridged, direct = (list(cells(table, f"2 A1: {name}").values()) for name in THROUGH)
    assert bridged[1:6] == ["2", "0", "1 (1 fell)", "0", "1"]
    assert bridged[6:11] == ["0.500", "10.0", "20.0", "3.00", "4.00"]
    assert bridged[11:] == ["1.00", "2.00", "3.00", "10.0"]
    assert direct[11:] == ["0.00", "1.00", "2.00", "0.0"]


def test_a_folder_holds_walks_of_one_configuration(tmp_path: Path) -> None:
    config = load(SOURCE / "deploy" / "desk.toml")
    keep_config(config, tmp_path)
    keep_config(replace(config, world=replace(config.world, seed=9)), tmp_path)
    rough = replace(config, world=replace(config.world, terrain="boxes"))
    with pytest.raises(ConfigError, match=r"world.terrain = 'flat', not 'boxes', expected a new"):
        keep_config(rough, tmp_path)


def test_the_page_is_in_step_with_the_published_rows() -> None:
    page = SOURCE / "docs" / "desk.md"
    assert page.read_text(encoding="utf-8") == to_markdown(SOURCE / PUBLISHED)


def test_the_page_is_true_that_20_tries_of_each_fault_count() -> None:
    counted = Counter[tuple[str, str]]()
    for folder in ("faults-2-a1", "faults-2-go2"):
        for found in read_rows(SOURCE / PUBLISHED / folder):
            counted[folder, found["fault"]] += "error" not in found and not is_too_slow(found)
    assert {fault for folder, fault in counted if folder == "faults-2-a1"} == set(BY_NAME)
    assert set(counted.values()) == {20}


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
