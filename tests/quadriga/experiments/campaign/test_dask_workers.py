"""A real scheduler with two workers that have no predictor, one of which is killed half way."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from quadriga.commands.parser import main
from quadriga.experiments.campaign import walk_trials
from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.shared.runtime.clock import monotonic, sleep
from tests.quadriga.experiments.processes import LONGEST, await_true, finished, start
from tests.quadriga.linear_data import arguments, put_data
from tests.quadriga.own_cache import share_behaviour

Said = pytest.CaptureFixture[str]


@pytest.fixture
def words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Two linear robots without and with planners, two seeds of half a second."""
    put_data(tmp_path / "cache", monkeypatch)
    scenario = tmp_path / "flat.toml"
    scenario.write_text("[world]\nduration = 0.5\n", encoding="utf-8")
    return [str(scenario), "--planners", "none,distributed,deepc", "--seeds", "0:2", *arguments()]


@contextmanager
def dask(*command: str, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of Dask's own command line, which ends with the block."""
    process = subprocess.Popen(
        [sys.executable, "-m", *command],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def await_address(file: Path) -> str:
    deadline = monotonic() + LONGEST
    while not file.exists() or not file.read_text(encoding="utf-8"):
        assert monotonic() < deadline
        sleep(0.02)
    return str(json.loads(file.read_text(encoding="utf-8"))["address"])


def untimed(folder: Path) -> list[TrialOutcome]:
    rows = [
        replace(row, wall_s=0.0, planner_ms_p50=None, planner_ms_p99=None)
        for row in read_rows(folder, read_manifest(folder))
    ]
    return sorted(rows, key=lambda row: (row.seed, row.variant))


def test_every_trial_is_finished_once_though_a_worker_is_killed(
    words: list[str], tmp_path: Path, capsys: Said
) -> None:
    file, out = tmp_path / "scheduler.json", tmp_path / "dask"
    scheduler = (
        "distributed.cli.dask_scheduler",
        "--scheduler-file",
        str(file),
        "--host",
        "127.0.0.1",
        "--port",
        "0",
        "--no-dashboard",
    )
    worker = (
        "distributed.cli.dask_worker",
        "--scheduler-file",
        str(file),
        "--nthreads",
        "1",
        "--no-nanny",
        "--no-dashboard",
        "--host",
        "127.0.0.1",
    )
    share_behaviour(tmp_path / "elsewhere")
    elsewhere = {"XDG_CACHE_HOME": str(tmp_path / "elsewhere")}
    with dask(*scheduler) as _, dask(*worker, **elsewhere) as first, dask(*worker, **elsewhere):
        process = start(*words, "--dask", await_address(file), "--out", str(out))
        await_true(lambda: len(finished(out)) >= 2, process)
        first.send_signal(signal.SIGKILL)
        assert len(finished(out)) < 6, "half way"
        output, _ = process.communicate(timeout=LONGEST)
        assert process.returncode == 0, output
    assert "Traceback" not in output
    shipped = list((tmp_path / "elsewhere" / "quadriga" / "shipped").iterdir())
    assert len(shipped) == 2, "a predictor, and the data that DeePC plans with"
    assert main(["campaign", *words, "--jobs", "1", "--out", str(tmp_path / "local")]) == 0
    assert untimed(out) == untimed(tmp_path / "local")
    assert len(untimed(out)) == 6
    assert {row.predictor_sha256 != "" for row in untimed(out) if row.variant != "none"} == {True}


def test_a_cluster_made_here_goes_with_the_campaign(words: list[str], tmp_path: Path) -> None:
    out = tmp_path / "out"
    variant = ("--planners", "plain:planner.kind=none", "--seeds", "0:2")
    process = start(words[0], *variant, "--robots", "1", "--dask", "--jobs", "1", "--out", str(out))
    output, _ = process.communicate(timeout=LONGEST)
    assert process.returncode == 0, output
    assert len(finished(out)) == 2


def test_without_the_extra_or_a_scheduler_it_costs_one_line(
    words: list[str], tmp_path: Path, capsys: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> Any:
        if name.endswith("dask_workers"):
            raise ModuleNotFoundError("no", name="distributed")
        return import_module(name)

    options = ["campaign", *words, "--planners", "plain:planner.kind=none", "--out", str(tmp_path)]
    with monkeypatch.context() as patch:
        patch.setattr(walk_trials, "import_module", missing)
        assert main([*options, "--dask"]) == 2
    errors = capsys.readouterr().err
    assert "--dask: got no package 'distributed', expected the extra 'campaign'" in errors
    assert errors.count("\n") == 1
