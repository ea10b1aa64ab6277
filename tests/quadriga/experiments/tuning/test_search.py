"""A search as it is typed: real walks, the same command again, and what it leaves."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.variants import parse_variants

Said = pytest.CaptureFixture[str]

SCENARIO = '[team]\nrobots = 1\n[world]\nterrain = "boxes"\nterrain_height = 0.03\nduration = 0.5\n'
TUNING = """
title = "Gains of one robot"
scenarios = ["SCENARIO"]
seeds = "0:2"
judged_on = "10:12"
walks = 1
population = 4
generations = 2
step = 0.2
seed = 3
[fixed]
planner.kind = "none"
[tuned]
"controller.kp_z" = { low = 100.0, high = 900.0 }
"controller.swing_height" = { low = 0.05, high = 0.12, logarithmic = false }
"""


def test_a_search_goes_on_where_it_ended_and_leaves_variants(tmp_path: Path, capsys: Said) -> None:
    scenario, file, out = tmp_path / "steps.toml", tmp_path / "gains.toml", tmp_path / "out"
    scenario.write_text(SCENARIO, encoding="utf-8")
    file.write_text(TUNING.replace("SCENARIO", str(scenario)), encoding="utf-8")
    typed = ["tune", str(file), "--jobs", "2", "--out", str(out)]

    assert main(typed) == 0
    search = json.loads((out / "search.json").read_text(encoding="utf-8"))
    assert [len(generation["candidates"]) for generation in search["generations"]] == [4, 4]
    walked = {path: path.read_bytes() for path in out.glob("*/trials.csv")}
    assert len(walked) == 3
    judged = out / "judged"
    rows = read_rows(judged, read_manifest(judged))
    assert {(row.variant, row.seed) for row in rows} == {
        (name, seed) for name in ("start", "tuned") for seed in (10, 11)
    }
    start, tuned = parse_variants([], out / "variants.toml")
    assert start.keys["controller.kp_z"] == 400.0
    assert tuned.keys == {
        "planner.kind": "none", **search["generations"][-1]["mean"]
    }  # fmt: skip
    assert tuned.keys != start.keys
    capsys.readouterr()

    (out / "search.json").unlink()
    assert main(typed) == 0
    assert json.loads((out / "search.json").read_text(encoding="utf-8")) == search
    assert {path: path.read_bytes() for path in walked} == walked


def test_a_mistake_costs_one_line(tmp_path: Path, capsys: Said) -> None:
    file = tmp_path / "gains.toml"
    file.write_text(TUNING.replace("SCENARIO", "flatt"), encoding="utf-8")
    assert main(["tune", str(file), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "flatt" in said
    assert "Traceback" not in said
    assert main(["tune", str(file), "--set", "controller.kp_z=100"]) == 2
    assert "quadriga tune: got --set, expected an option that it has" in capsys.readouterr().err


def test_scenarios_of_several_lengths_are_refused(tmp_path: Path, capsys: Said) -> None:
    file = tmp_path / "gains.toml"
    short, long = tmp_path / "short.toml", tmp_path / "long.toml"
    short.write_text(SCENARIO, encoding="utf-8")
    long.write_text(SCENARIO.replace("duration = 0.5", "duration = 0.8"), encoding="utf-8")
    file.write_text(TUNING.replace("SCENARIO", f'{short}", "{long}'), encoding="utf-8")
    assert main(["tune", str(file), "--out", str(tmp_path / "out")]) == 2
    assert "world.duration of 0.5 and 0.8" in capsys.readouterr().err
