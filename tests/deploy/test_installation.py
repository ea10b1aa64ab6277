"""The installed project beside others whose packages have the names of this project's folders."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
NEIGHBOUR = "openai-agents==0.24.0"  # installs a package `agents`
FOLDERS = ("agents", "shared", "sim_server", "plant")


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with this project and its neighbour, built and installed anew."""
    folder = tmp_path_factory.mktemp("installed")
    source, environment = folder / "source", folder / "environment"
    leave = shutil.ignore_patterns(".*", "runs", "build", "*.egg-info", "__pycache__", "tests")
    shutil.copytree(TOP, source, symlinks=True, ignore=leave)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    packages = next(environment.glob("lib/python*/site-packages"))
    # The libraries that the project needs are those that it is tested with.
    libraries = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
    (packages / "libraries.pth").write_text(libraries, encoding="utf-8")
    install: list[str | Path] = [
        sys.executable, "-m", "pip", "--python", environment / "bin" / "python", "install",
        "--quiet", "--no-deps", "--no-build-isolation", "--ignore-installed",
    ]  # fmt: skip
    for what in (source, NEIGHBOUR):
        done = subprocess.run([*install, what], check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return environment


def run(environment: Path, *words: str | Path, folder: Path) -> str:
    variables = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [environment / "bin" / words[0], *words[1:]],
        cwd=folder,
        env={**variables, "NUMBA_DISABLE_JIT": "1"},
        check=False,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_nothing_but_quadriga_is_installed(environment: Path) -> None:
    packages = next(environment.glob("lib/python*/site-packages"))
    record = next(packages.glob("quadriga-*.dist-info")) / "RECORD"
    tops = {line.split("/")[0] for line in record.read_text(encoding="utf-8").splitlines()}
    assert {top for top in tops if "dist-info" not in top and top != ".."} == {"quadriga"}


def test_a_team_walks_beside_a_package_named_agents(environment: Path, tmp_path: Path) -> None:
    """In a folder, too, in which other things have the names of this project's folders."""
    for name in FOLDERS:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('foreign')\n")
    where = (
        "from importlib.util import find_spec as spec; "
        "print(spec('agents').origin, spec('quadriga.agents').origin)"
    )
    theirs, ours = run(environment, "python", "-P", "-c", where, folder=tmp_path).split()
    packages = next(environment.glob("lib/python*/site-packages"))
    assert Path(theirs) == packages / "agents" / "__init__.py"
    assert Path(ours) == packages / "quadriga" / "agents" / "__init__.py"
    walk = ("--robots", "1", "--seconds", "0.5", "--planner", "none", "--out", tmp_path / "run")
    early = "gait.stand_ms=100"  # each tick takes long without machine code, in the rehearsal too
    run(environment, "python", "-m", "quadriga", "walk", *walk, "--set", early, folder=tmp_path)
    assert (tmp_path / "run" / "run.mcap").stat().st_size > 10_000
