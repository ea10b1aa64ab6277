"""A digest of behaviour changes with what code does, and with nothing else."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from multiprocessing import Process
from pathlib import Path

import numpy as np
import pytest

import quadriga
from quadriga.identification import behaviour as module
from quadriga.identification import sample_fits
from quadriga.identification.behaviour import behaviour, digest_of, numbers
from quadriga.shared.robots.conventions import Array

# A short walk of one robot: machine code for each copy of the package would take a minute.
SHORT = """
from quadriga.identification import sample_collection, sample_fits
from quadriga.identification.behaviour import digest_of
sample_collection._SECONDS, sample_collection._WALKS = 0.04, ({"team.robots": 1},)
sample_fits._SAMPLES = 200
print(digest_of(sample_collection.samples()), digest_of(sample_fits.samples()))
"""
ROOT = "quadriga.identification.sample_fits"


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The package, in a folder of its own."""
    whole = Path(quadriga.__file__).parent
    shutil.copytree(
        whole, tmp_path / "quadriga", ignore=shutil.ignore_patterns("__pycache__", "compiled-*")
    )
    return tmp_path


def short_digests(root: Path) -> list[str]:
    """Of walks and of fits by the code in a folder."""
    environment = {**os.environ, "PYTHONPATH": str(root), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SHORT],
        env=environment,
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return done.stdout.split()


def edit(root: Path, pattern: str, new: str) -> None:
    """Replace in every file of the package; something must change."""
    changed = 0
    for path in root.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        edited = re.sub(pattern, new, text)
        changed += edited != text
        path.write_text(edited, encoding="utf-8")
    assert changed


def test_new_names_and_comments_change_no_digest_and_a_gain_does(copy: Path) -> None:
    before = short_digests(copy)
    (copy / "quadriga/agents/gait.py").rename(copy / "quadriga/agents/trot.py")
    edit(copy, r"\bquadriga\.agents\.gait\b", "quadriga.agents.trot")
    edit(copy, r"\bnominal_forces\b", "resting_forces")
    edit(copy, r"\Z", "\n# Why all of this is so.\n")
    assert short_digests(copy) == before
    edit(copy, r"kp_z: float = number\(400\.0", "kp_z: float = number(401.0")
    edit(copy, r"(?m)^U_SCALE: Final = 10\.0", "U_SCALE: Final = 10.5")
    after = short_digests(copy)
    assert [new != old for new, old in zip(after, before, strict=True)] == [True, True]


def test_samples_give_the_same_numbers_each_time() -> None:
    assert digest_of(sample_fits.samples()) == digest_of(sample_fits.samples())


def test_a_digest_is_of_numbers_alone() -> None:
    one = digest_of([np.arange(6.0), numbers(None, 1)])
    assert one == digest_of([np.arange(6.0).reshape(2, 3), np.array([np.nan, 1.0])])
    assert one != digest_of([np.arange(6.0), numbers(None, 2)])
    assert len(one) == 16


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    behaviour.cache_clear()
    return tmp_path / "quadriga" / "behaviour"


def counted(folder: Path) -> Iterator[Array]:
    (folder / f"run-{os.getpid()}").touch()
    yield np.arange(3.0)


def ask(folder: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample_fits, "samples", lambda: counted(folder))
        behaviour(ROOT)


def test_samples_are_run_once_by_one_of_all_processes(cache: Path, tmp_path: Path) -> None:
    others = [Process(target=ask, args=(tmp_path,)) for _ in range(3)]
    for other in others:
        other.start()
    for other in others:
        other.join(60)
    ask(tmp_path)
    assert [other.exitcode for other in others] == [0, 0, 0]
    assert len(list(tmp_path.glob("run-*"))) == 1
    (kept,) = (path for path in cache.iterdir() if path.name != ".lock")
    assert kept.read_text(encoding="ascii") == digest_of([np.arange(3.0)])


def test_other_sources_and_other_arithmetic_ask_for_new_samples(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ask(tmp_path)
    for name in ("sources_digest", "arithmetic_digest"):
        behaviour.cache_clear()
        monkeypatch.setattr(module, name, lambda *_: "another")
        ask(tmp_path)
    assert len([path for path in cache.iterdir() if path.name != ".lock"]) == 3
