"""Machine code is kept for as long as nothing changes that it is made of."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from quadriga.shared.runtime import jit_cache, places
from quadriga.shared.runtime.jit_cache import followed_files

COPIED = ("runtime/jit.py", "runtime/jit_cache.py", "runtime/places.py")
SHARED = places.SOURCE / "quadriga" / "shared"
FILES = {
    **{f"quadriga/shared/{name}": (SHARED / name).read_text(encoding="utf-8") for name in COPIED},
    **{f"quadriga/{name}__init__.py": "" for name in ("", "shared/", "shared/runtime/", "agents/")},
    "quadriga/shared/numbers.py": "OFFSET = 0.5\n",
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
        put(tmp_path, name, text)
    return tmp_path


def put(root: Path, name: str, text: str) -> None:
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text, encoding="utf-8")


def run(package: Path, **variables: str) -> tuple[float, int]:
    """What the caller gives, and how much of it was compiled before."""
    command, env = [sys.executable, "-c", SCRIPT], {**os.environ, "PYTHONPATH": str(package)}
    said = subprocess.check_output(command, env=env | variables, cwd=package, text=True)
    value, hits = said.split()
    return float(value), int(hits)


def edit(file: Path, old: str, new: str) -> None:
    file.write_text(file.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def test_what_is_called_and_what_it_counts_with_is_compiled_anew(package: Path) -> None:
    assert run(package) == (2.5, 0)
    assert run(package) == (2.5, 1)
    edit(package / "quadriga/agents/idle.py", "0", "1")
    assert run(package) == (2.5, 1)
    edit(package / "quadriga/agents/called.py", "2.0", "3.0")
    assert run(package) == (3.5, 0)
    edit(package / "quadriga/shared/numbers.py", "0.5", "0.25")
    assert run(package) == (3.25, 0)
    kept = [*(package / "quadriga/shared/__pycache__").glob("compiled-*")]
    assert len(kept) == 1, "no heap of what is of no use any more"


def test_so_it_is_in_a_folder_that_the_user_names(package: Path, tmp_path: Path) -> None:
    there, mine = str(tmp_path / "there"), tmp_path / "there" / "compiled-mydata" / "precious"
    put(tmp_path, "there/compiled-mydata/precious", "")
    assert run(package, NUMBA_CACHE_DIR=there) == (2.5, 0)
    edit(package / "quadriga/agents/called.py", "2.0", "3.0")
    assert run(package, NUMBA_CACHE_DIR=there) == (3.5, 0)
    assert mine.exists()
    assert len([*mine.parents[1].glob("compiled-*")]) == 2, "but older machine code goes"
    for _ in range(2):  # where nothing can be kept each process compiles for itself
        assert run(package, NUMBA_CACHE_DIR="/proc/none") == (3.5, 0)
    assert not list((package / "quadriga/shared/__pycache__").glob("compiled-*"))


def test_what_is_empty_or_damaged_is_compiled_anew(package: Path) -> None:
    assert run(package) == (2.5, 0)
    kept = package / "quadriga/shared/__pycache__"
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


def test_the_sources_are_those_with_compiled_functions_and_what_they_import() -> None:
    root = places.SOURCE
    found = {str(path.relative_to(root)) for path in jit_cache.sources(root)}
    assert {"quadriga/agents/gait.py", "quadriga/shared/robots/a1.py"} <= found
    assert not {"quadriga/agents/process.py", "quadriga/shared/bus/session.py"} & found


@pytest.mark.parametrize(
    "text",
    [
        "import pack.room.c as other\n",
        "from pack.room import c\n",
        "from pack.room.c import (\n    X,\n    X as Y,\n)\n",
        "def f():\n    if True:\n        from pack.room.c import X\n    return X\n",
        "from pack import b\n",
        'def f(name):\n    return import_module(f"pack.room.{name}")\n',
    ],
)
def test_every_form_of_an_import_is_followed(tmp_path: Path, text: str) -> None:
    """Also of imports and in circles; libraries beside the package are left out."""
    for name in ("pack/__init__", "pack/room/__init__", "pack/room/c", "library/__init__"):
        put(tmp_path, f"{name}.py", "X = 1\n")
    put(tmp_path, "pack/b.py", "from pack import a\nfrom pack.room.c import X\n")
    put(tmp_path, "pack/a.py", f"import os.path\nimport library.part\n{text}")
    found = {str(path.relative_to(tmp_path)) for path in followed_files(tmp_path, ["pack.a"])}
    wanted = {"pack/__init__.py", "pack/a.py", "pack/room/__init__.py", "pack/room/c.py"}
    assert found - {"pack/b.py"} == wanted
