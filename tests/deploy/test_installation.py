"""The installed project beside others whose packages have the names of this project's folders."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tarfile
from email.parser import HeaderParser
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.deploy.dist import TOP, build_dist

NEIGHBOUR = "openai-agents==0.24.0"  # installs a package `agents`
FOLDERS = ("agents", "shared", "sim_server", "plant")
# What a script sees of the installed package, far from its checkout.
SEEN = """
import quadriga
from quadriga.experiments.published.catalogue import list_names
from quadriga.shared.runtime.places import SCENARIOS
from quadriga.team.scenarios import names
print(quadriga.load_config(scenario="stairs").world.scenario, len(names()), len(list_names()))
print(quadriga.__file__, SCENARIOS)
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel and the source distribution that it is built from."""
    return build_dist(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def environment(built: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with this project, from its wheel, and its neighbour."""
    environment = tmp_path_factory.mktemp("installed") / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    packages = next(environment.glob("lib/python*/site-packages"))
    # The libraries that the project needs are those that it is tested with.
    libraries = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
    (packages / "libraries.pth").write_text(libraries, encoding="utf-8")
    install: list[str | Path] = [
        sys.executable, "-m", "pip", "--python", environment / "bin" / "python", "install",
        "--quiet", "--no-deps", "--ignore-installed",
    ]  # fmt: skip
    for what in (built[0], NEIGHBOUR):
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


def files_of_the_package() -> dict[str, bytes]:
    """Every file of the package in the checkout, with those that are linked into it."""
    return {
        (folder / name).relative_to(TOP).as_posix(): (folder / name).read_bytes()
        for parent, _, names in os.walk(TOP / "quadriga", followlinks=True)
        for folder in [Path(parent)]
        for name in names
        if "__pycache__" not in folder.parts
    }


def test_the_wheel_holds_every_file_of_the_package_once_and_nothing_else(
    built: tuple[Path, Path],
) -> None:
    """It is built from the source distribution, so that one holds them, too."""
    with ZipFile(built[0]) as wheel:
        held = {name: wheel.read(name) for name in wheel.namelist() if ".dist-info/" not in name}
    expected = files_of_the_package()
    assert held.keys() == expected.keys()
    assert held == expected
    needed = (
        "py.typed",
        "__init__.pyi",
        "agents/process.py",
        "drive/page/drive.js",
        "report/document.html",
        "deploy/scenarios/joystick.csv",
        "deploy/experiments/paper.toml",
    )
    assert {f"quadriga/{name}" for name in needed} <= held.keys()
    with tarfile.open(built[1]) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    assert {"pyproject.toml", "README.md", "LICENSE", "requirements.lock", *expected} <= names


def test_the_metadata_say_what_it_is(built: tuple[Path, Path]) -> None:
    with ZipFile(built[0]) as wheel:
        (folder,) = {name.split("/")[0] for name in wheel.namelist() if ".dist-info/" in name}
        about = HeaderParser().parsestr(wheel.read(f"{folder}/METADATA").decode())
        scripts = wheel.read(f"{folder}/entry_points.txt").decode()
        assert f"{folder}/licenses/LICENSE" in wheel.namelist()
    assert (about["Name"], about["License-Expression"]) == ("quadriga", "Apache-2.0")
    assert about["Description-Content-Type"] == "text/markdown"
    assert "Typing :: Typed" in about.get_all("Classifier", [])
    assert {"frame", "export", "campaign"} <= {*about.get_all("Provides-Extra", [])}
    assert "quadriga = quadriga.__main__:main" in scripts


@pytest.mark.nightly
def test_a_script_far_from_the_checkout_has_scenarios_and_experiments(
    environment: Path, tmp_path: Path
) -> None:
    packages = next(environment.glob("lib/python*/site-packages"))
    counts, places = run(environment, "python", "-c", SEEN, folder=tmp_path).splitlines()
    scenarios, experiments = (
        len([*(TOP / "deploy" / name).glob("*.toml")]) for name in ("scenarios", "experiments")
    )
    assert counts == f"stairs {scenarios} {experiments}"
    for place in places.split():
        assert Path(place).is_relative_to(packages / "quadriga")


@pytest.mark.nightly
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
