"""The page of a campaign from its folder alone."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.experiments.campaign.ledger import Ledger
from quadriga.experiments.campaign.manifest import Manifest
from quadriga.experiments.trial.outcome import TrialOutcome
from tests.quadriga.experiments.rows import manifest, row
from tests.quadriga.report.outline import Outline

Said = pytest.CaptureFixture[str]


def write(folder: Path, mine: Manifest, rows: list[TrialOutcome]) -> Path:
    with Ledger(folder, mine) as ledger:
        for one in rows:
            ledger.append(one)
    return folder


def report(folder: Path, *options: str) -> Outline:
    assert main(["campaign", "--report", str(folder), *options]) == 0
    return Outline((folder / "report.html").read_text(encoding="utf-8"))


def test_the_page_says_what_the_rows_say(capsys: Said, tmp_path: Path) -> None:
    rows = [row("none", seed, fell=2.5 if seed < 4 else None) for seed in range(10)]
    rows += [row("<b>", seed) for seed in range(7)]
    found = report(write(tmp_path / "c", manifest("none", "<b>"), rows))
    assert found.sections == ["success", "falls", "errors", "tracking", "worst", "walked"]
    assert {link[1:] for link in found.links} <= found.anchors
    assert "17 walks: 2 variants, 1 world, 10 seeds (0 … 9), paired" in found.text
    assert "3 are still to be walked" in found.text
    assert found.figures == ["success by variant", "falls against none", "errors against none"]
    assert "r2 fell at 2.50 s" in found.text
    assert "Did not fall where the baseline did: seeds 0 … 3." in found.text
    assert "c/configs/steps-none.toml --seed 0 --out" in found.text
    output = capsys.readouterr()
    assert "Falls against none" in output.out
    tables = (tmp_path / "c" / "report.md").read_text(encoding="utf-8")
    assert (
        "| steps | none | 10 | 60.0\N{NO-BREAK SPACE}[31.3,\N{NO-BREAK SPACE}83.2] | 4 | 0 |"
        in tables
    )
    assert "quadriga campaign steps" in tables
    other = report(tmp_path / "c", "--baseline", "<b>")
    assert "Fell where the baseline did not: seeds 0 … 3." in other.text


def test_success_is_drawn_against_what_was_swept(tmp_path: Path) -> None:
    swept = (("80", "0"), ("120", "0"), ("80", "9"), ("120", "9"))
    mine = manifest("none", "damped", sweeps=("world.push", "world.payload"), swept=swept)
    rows = [row(v, seed, swept=s) for v in ("none", "damped") for s in swept for seed in range(3)]
    found = report(write(tmp_path / "c", mine, rows))
    assert found.figures[:2] == ["success against world.push", "success against world.payload"]


def test_what_is_no_campaign_costs_one_line(capsys: Said, tmp_path: Path) -> None:
    empty = write(tmp_path / "empty", manifest("none"), [])
    for options, message in (
        (["--report", str(tmp_path)], "campaign.json"),
        (["--report", str(empty)], "got no trial"),
        (["--report", str(empty), "--baseline", "x"], "--baseline: got 'x'"),
        (["flat.toml", "--report", str(empty)], "got scenarios flat.toml, expected none: it walks"),
        (["--report", str(empty), "--seeds", "0:3"], "--report: got --seeds 0:3"),
        (["--report", str(empty), "--out", "x"], "--report: got --out x"),
        (["--report", str(empty), "--sweep", "a=1", "--vx", "1"], "--report: got --sweep a=1"),
        (["--report", str(empty), "--vx", "0.2"], "--report: got reference.vx 0.2"),
        (["--report", str(empty), "--record-worst", "-1"], "--record-worst: got -1"),
        ([], "scenarios: got none"),
        (["x.toml", "--dask", "y.toml"], "--dask: got 'y.toml'"),
    ):
        assert main(["campaign", *options]) == 2
        output = capsys.readouterr().err
        assert message in output
        assert output.count("\n") == 1


def test_a_manifest_survives_json(tmp_path: Path) -> None:
    mine = manifest("none", sweeps=("world.payload",), swept=(("9",),))
    assert Manifest.from_dict({**asdict(mine)}) == mine
