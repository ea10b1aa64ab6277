"""Our four-tank plans beside those of other packages, where these are installed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.four_tank import agreement
from benchmarks.four_tank_peers import HOW_TO_INSTALL, PEERS, is_installed
from quadriga.agents.predictor.four_tank import four_tank

TOP = Path(__file__).parents[2]


@pytest.mark.filterwarnings("ignore::UserWarning")  # of CVXPY, about how it is used
@pytest.mark.parametrize("name", PEERS)
def test_answers_without_noise_are_those_of_the_package(name: str) -> None:
    if not is_installed(name):
        pytest.skip(f"{name} is not installed: {HOW_TO_INSTALL[name]}")
    found = agreement(name, four_tank(), 3, 4)
    assert found.prediction < 1e-8
    assert found.truth < 1e-8
    assert found.inputs < 1e-7
    assert found.closed_loop < 1e-2, "as exact as its usual tolerance"
    assert min(found.plan, found.plan_own) > 0.0


def test_the_page_names_what_is_missing_and_compares_the_rest(tmp_path: Path) -> None:
    out = tmp_path / "tanks.json"
    words = [sys.executable, "-m", "benchmarks.four_tank", "--plans", "2", "--steps", "3"]
    done = subprocess.run(
        [*words, "--out", str(out)], cwd=TOP, check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(out.read_text(encoding="utf-8"))
    missing = [name for name in PEERS if not is_installed(name)]
    assert list(found["missing"]) == missing
    assert all(f"{name} is not installed: " in done.stdout for name in missing)
    names = [loop["name"] for loop in found["closed_loops"]]
    assert names[:3] == ["ours, pinv", "ours, ridge", "ours, deepc"]
    assert all(loop["cost"] > 0.0 for loop in found["closed_loops"])
