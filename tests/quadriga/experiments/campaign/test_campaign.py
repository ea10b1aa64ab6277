"""A campaign as it is typed: real walks, Ctrl-C, kill -9, and the same command again."""

from __future__ import annotations

import csv
import json
import signal
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from quadriga.commands.parser import main
from quadriga.experiments.campaign.job import TrialJob, walk_trial
from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.plan import Group
from quadriga.experiments.predictors import Fitted
from quadriga.experiments.trial.origin import code_and_libraries
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.shared.config.load import load
from quadriga.shared.errors import ProcessError
from tests.quadriga.experiments.processes import await_gone, await_true, children, finished, start

Said = pytest.CaptureFixture[str]
SOFT = "soft:planner.kind=none;controller.kp_tilt=500.0"


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """One robot on small boxes for half a second."""
    path = tmp_path / "steps.toml"
    path.write_text(
        '[team]\nrobots = 1\n[world]\nterrain = "boxes"\nterrain_height = 0.03\nduration = 0.5\n',
        encoding="utf-8",
    )
    return path


def untimed(row: TrialOutcome) -> TrialOutcome:
    """Without what depends on the machine."""
    return replace(row, wall_s=0.0, planner_ms_p50=None, planner_ms_p99=None)


def rows_of(folder: Path) -> dict[tuple[Group, int], TrialOutcome]:
    found = read_rows(folder, read_manifest(folder))
    return {(row.group, row.seed): untimed(row) for row in found}


def test_a_campaign_survives_ctrl_c_and_kill_and_walks_nothing_twice(
    scenario: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = (
        str(scenario),
        "--planners",
        f"none,{SOFT}",
        "--seeds",
        "0:6",
        "--jobs",
        "2",
        "--out",
        str(out),
    )
    for number, least, status in ((signal.SIGINT, 1, 130), (signal.SIGKILL, 4, -9)):
        process = start(*words)
        await_true(lambda least=least: len(finished(out)) >= least, process)  # type: ignore[misc]
        workers = children(process.pid)
        assert len(workers) >= 2
        process.send_signal(number)
        output, _ = process.communicate(timeout=300.0)
        assert process.returncode == status
        assert "Traceback" not in output
        await_gone(workers)
    kept = rows_of(out)
    assert 4 <= len(kept) < 12
    process = start(*words)
    output, _ = process.communicate(timeout=300.0)
    assert process.returncode == 0, output
    assert f"{len(kept)} of 12 trials are walked already" in output
    assert f"{12 - len(kept)} trials in" in output
    done = rows_of(out)
    assert len(done) == 12
    assert kept.items() <= done.items()
    with (out / "trials.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == 12
    config = load(out / "configs" / "steps-soft.toml")
    assert config.controller.kp_tilt == 500.0
    job = TrialJob(Group("steps", "soft", ()), 5, config, Fitted(), code_and_libraries())
    assert untimed(walk_trial(job)) == done[job.group, 5], "as walked in this process"
    with pytest.raises(ProcessError, match="a worker's code and libraries: got python"):
        walk_trial(replace(job, versions="code 0"))
    with pytest.raises(
        ProcessError, match=r"a worker's planner or controller: .*expected mine 0\.1 ab"
    ):
        walk_trial(replace(job, plugin="mine 0.1 ab"))
    table = pq.read_table(out / "trials.parquet").to_pylist()
    assert {(row["variant"], row["seed"]): row["energy_j"] for row in table} == {
        (group.variant, seed): row.energy_j for (group, seed), row in done.items()
    }


def test_trials_of_another_configuration_or_code_are_not_mixed(
    capsys: Said, scenario: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = ["campaign", str(scenario), "--planners", "none", "--jobs", "1", "--out", str(out)]
    assert main([*words, "--seeds", "0"]) == 0
    assert capsys.readouterr().out.endswith(f"{out}/report.html\n")
    assert main([*words, "--seeds", "0:2", "--vx", "0.3"]) == 2
    assert "trials of configuration" in capsys.readouterr().err
    manifest = out / "campaign.json"
    body = json.loads(manifest.read_text(encoding="utf-8"))
    manifest.write_text(json.dumps(body | {"versions": "code 0"}), encoding="utf-8")
    assert main([*words, "--seeds", "0:2"]) == 2
    errors = capsys.readouterr().err
    assert "trials with code and versions code 0" in errors
    assert errors.count("\n") == 1
    manifest.write_text(json.dumps(body), encoding="utf-8")
    assert main([*words, "--seeds", "0:2"]) == 0
    assert sorted(seed for _, seed in rows_of(out)) == [0, 1]


def test_over_the_bus_a_campaign_comes_to_the_same_and_keeps_recordings(
    capsys: Said, scenario: Path, tmp_path: Path
) -> None:
    words = ["campaign", str(scenario), "--planners", "none", "--seconds", "1.4", "--seeds", "3"]
    alone, bus = tmp_path / "alone", tmp_path / "bus"
    assert main([*words, "--jobs", "1", "--out", str(alone)]) == 0
    half = bus / "recordings" / "steps-none-3" / "run.mcap"  # of a walk that was interrupted
    half.parent.mkdir(parents=True)
    half.write_bytes(b"")
    assert main([*words, "--bus", "--out", str(bus)]) == 0, capsys.readouterr().err
    (row,), (same,) = rows_of(alone).values(), rows_of(bus).values()
    assert replace(row, energy_j=None, cost_of_transport=None) == same
    assert 'href="recordings/steps-none-3/report.html"' in (bus / "report.html").read_text()
    assert main([*words, "--bus", "--dask", "--out", str(bus)]) == 2
    assert "--bus: got --dask beside it" in capsys.readouterr().err


def test_a_fall_ends_a_trial_and_its_recording_falls_too(
    capsys: Said, scenario: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = [
        "campaign",
        str(scenario),
        "--planners",
        "none",
        "--seeds",
        "3",
        "--seconds",
        "2",
        "--push",
        "r1:2000:90:0.5:0.2",
        "--jobs",
        "1",
        "--out",
        str(out),
    ]
    assert main([*words, "--record-worst", "1"]) == 0, capsys.readouterr().err
    (row,) = rows_of(out).values()
    assert row.fell
    assert not row.success
    assert row.first_to_fall == "r1"
    assert row.time_to_fall_s is not None
    assert 0.5 < row.time_to_fall_s < 1.9
    assert row.seconds == row.time_to_fall_s
    page = out / "recordings" / "steps-none-3" / "report.html"
    assert page.is_file()
    assert 'href="recordings/steps-none-3/report.html"' in (out / "report.html").read_text()
    before = page.stat().st_mtime_ns
    assert main(["campaign", "--report", str(out), "--record-worst", "1"]) == 0
    assert page.stat().st_mtime_ns == before, "recorded once"
    for name in ("campaign.json", "trials.csv"):
        text = (out / name).read_text(encoding="utf-8")
        (out / name).write_text(text.replace("quadriga 0", "quadriga 9"), encoding="utf-8")
    capsys.readouterr()
    assert main(["campaign", "--report", str(out), "--record-worst", "1"]) == 2
    errors = capsys.readouterr().err
    assert "trials with code and versions" in errors
    assert errors.count("\n") == 1
