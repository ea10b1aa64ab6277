"""Machine code is kept for as long as nothing changes that it is made of."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from quadriga.shared import errors
from quadriga.shared.runtime import atomic, imports, jit, jit_cache, jit_references, places

FILES = {
    "quadriga/__init__.py": "",
    "quadriga/shared/__init__.py": "",
    "quadriga/shared/runtime/__init__.py": "",
    "quadriga/shared/runtime/jit.py": Path(jit.__file__).read_text(encoding="utf-8"),
    "quadriga/shared/runtime/jit_cache.py": Path(jit_cache.__file__).read_text(encoding="utf-8"),
    "quadriga/shared/runtime/atomic.py": Path(atomic.__file__).read_text(encoding="utf-8"),
    "quadriga/shared/runtime/jit_references.py": Path(jit_references.__file__).read_text(
        encoding="utf-8"
    ),
    "quadriga/shared/errors.py": Path(errors.__file__).read_text(encoding="utf-8"),
    "quadriga/shared/runtime/imports.py": Path(imports.__file__).read_text(encoding="utf-8"),
    "quadriga/shared/runtime/places.py": Path(places.__file__).read_text(encoding="utf-8"),
    "quadriga/shared/numbers.py": "OFFSET = 0.5\n",
    "quadriga/agents/__init__.py": "",
    "quadriga/agents/idle.py": "NOTHING = 0\n",
    "quadriga/agents/called.py": (
        "from quadriga.shared.runtime.jit import compiled\n"
        "from quadriga.shared.numbers import OFFSET\n\n\n"
        "@compiled\ndef called(x):\n    return 2.0 * x + OFFSET\n"
    ),
    "quadriga/agents/caller.py": (
        "from quadriga.agents.called import called\n"
        "from quadriga.shared.runtime.jit import compiled\n\n\n"
        "@compiled\ndef caller(x):\n    return called(x)\n"
    ),
}
SCRIPT = (
    "from quadriga.agents.caller import caller; found = caller(1.0); "
    "print(found, sum(caller.stats.cache_hits.values()))"
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def run(package: Path, **variables: str) -> tuple[float, int]:
    """What the caller gives, and how much of it was compiled before."""
    environment = {**os.environ, "PYTHONPATH": str(package), **variables}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=environment,
        cwd=package,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    value, hits = done.stdout.split()
    return float(value), int(hits)


def edit(file: Path, old: str, new: str) -> None:
    file.write_text(file.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def test_what_is_called_and_what_it_counts_with_is_compiled_anew(package: Path) -> None:
    assert run(package) == (2.5, 0)
    assert run(package) == (2.5, 1)
    edit(package / "quadriga" / "agents" / "idle.py", "0", "1")
    assert run(package) == (2.5, 1)
    edit(package / "quadriga" / "agents" / "called.py", "2.0", "3.0")
    assert run(package) == (3.5, 0)
    edit(package / "quadriga" / "shared" / "numbers.py", "0.5", "0.25")
    assert run(package) == (3.25, 0)
    assert run(package) == (3.25, 1)
    kept = [
        path.name for path in (package / "quadriga" / "shared" / "__pycache__").glob("compiled-*")
    ]
    assert len(kept) == 1, "no heap of what is of no use any more"


def test_what_is_empty_or_damaged_is_compiled_anew(package: Path) -> None:
    assert run(package) == (2.5, 0)
    kept = package / "quadriga" / "shared" / "__pycache__"
    for pattern, length, hits in (("*.nbc", -9, 0), ("*.nbi", 0, 0), ("none", 0, 1)):
        for file in kept.rglob(pattern):
            code = file.read_bytes()
            file.write_bytes(code[:length] and code[:length] + bytes(-length))
        assert run(package) == (2.5, hits), pattern


def test_on_a_full_disk_only_what_is_complete_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=4096))
    assert jit_cache.compiled_folder.__wrapped__() is None
    (folder,) = tmp_path.glob("compiled-*")
    (folder / jit_cache.REHEARSED).touch()
    assert jit_cache.compiled_folder.__wrapped__() == folder


def test_so_it_is_in_a_folder_that_the_user_names(package: Path, tmp_path: Path) -> None:
    there = str(tmp_path / "there")
    mine = tmp_path / "there" / "compiled-mydata" / "precious"
    mine.parent.mkdir(parents=True)
    mine.touch()
    assert run(package, NUMBA_CACHE_DIR=there) == (2.5, 0)
    assert run(package, NUMBA_CACHE_DIR=there) == (2.5, 1)
    edit(package / "quadriga" / "agents" / "called.py", "2.0", "3.0")
    assert run(package, NUMBA_CACHE_DIR=there) == (3.5, 0)
    assert mine.exists()
    assert len([*mine.parents[1].glob("compiled-*")]) == 2, "but older machine code goes"
    assert not list((package / "quadriga" / "shared" / "__pycache__").glob("compiled-*"))


def test_where_nothing_can_be_kept_each_process_compiles_for_itself(package: Path) -> None:
    assert run(package, NUMBA_CACHE_DIR="/proc/none") == (2.5, 0)
    assert run(package, NUMBA_CACHE_DIR="/proc/none") == (2.5, 0)
    assert not list((package / "quadriga" / "shared" / "__pycache__").glob("compiled-*"))


def test_the_sources_are_those_with_compiled_functions_and_what_they_import() -> None:
    root = places.SOURCE
    found = {str(path.relative_to(root)) for path in jit_cache.sources(root)}
    assert {
        "quadriga/agents/estimator/filter.py",
        "quadriga/agents/controller/swing.py",
        "quadriga/agents/gait.py",
        "quadriga/shared/robots/a1.py",
        "quadriga/sim_server/world/sensors.py",
    } <= found
    assert (
        not {
            "quadriga/agents/process.py",
            "quadriga/shared/bus/session.py",
            "quadriga/sim_server/world/world.py",
        }
        & found
    )
