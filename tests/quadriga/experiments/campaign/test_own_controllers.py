"""A campaign judges controllers of one's own in the same worlds; who fails has not walked."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.campaign.recordings import run_dir_of
from quadriga.experiments.plan import Group

STAND = """
from quadriga.controller import build_command, read_task, serve

robot = read_task().config.robot

def step(state, reference):
    if state.tick == FAILS:
        raise RuntimeError("on purpose")
    return build_command(state, q_des=robot.q_stand, kp=80.0, kd=3.0)

serve(step)
"""


def script(folder: Path, name: str, fails: int) -> Path:
    path = folder / f"{name}.py"
    path.write_text(STAND.replace("FAILS", str(fails)), encoding="utf-8")
    return path


def test_controllers_are_walked_beside_the_projects_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, out = tmp_path / "short.toml", tmp_path / "out"
    scenario.write_text(
        "[team]\nrobots = 1\n[world]\nduration = 0.5\n[gait]\nstand_ms = 100\n", encoding="utf-8"
    )
    stands, fails = script(tmp_path, "stands", -1), script(tmp_path, "fails", 300)
    variants = (
        f"none,stands:team.agent_command=python {stands},fails:team.agent_command=python {fails}"
    )
    words = ["campaign", str(scenario), "--jobs", "1", "--out", str(out), "--planners", variants]
    assert main([*words, "--seeds", "0"]) == 0
    rows = {row.variant: row for row in read_rows(out, read_manifest(out))}
    assert {name: row.success for name, row in rows.items()} == {
        "none": True,
        "stands": True,
        "fails": False,
    }
    assert rows["none"].energy_j is not None
    stood, failed = rows["stands"], rows["fails"]
    assert (stood.seconds, stood.fell, stood.stopped, stood.plans) == (0.49, False, "", "")
    assert (stood.energy_j, stood.control_cost, stood.planner_ms_p50) == (None, None, None)
    assert failed.stopped == "r1: controller-failed:exit status 1"
    assert not failed.fell
    folder = run_dir_of(out, Group("short", "fails", ()), 0)
    assert "RuntimeError: on purpose" in (folder / "logs" / "r1.log").read_text()
    assert (folder / "report.html").is_file()
    capsys.readouterr()
    script(tmp_path, "stands", -2)
    assert main([*words, "--seeds", "0:2"]) == 2
    assert f"trials of planner or controller python {stands} " in capsys.readouterr().err


def test_a_controller_that_cannot_even_start_ends_the_campaign(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = tmp_path / "short.toml"
    scenario.write_text("[team]\nrobots = 1\n[world]\nduration = 0.5\n", encoding="utf-8")
    words = ["campaign", str(scenario), "--jobs", "1", "--out", str(tmp_path / "out")]
    planners = ["--planners", "mine:team.agent_command=python no_such.py"]
    assert main([*words, *planners, "--seeds", "0"]) == 2
    assert "team.agent_command: got no file 'no_such.py'" in capsys.readouterr().err
