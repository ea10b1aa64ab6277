"""A planner that another package brings: every command takes it, and no file here knows it.

The commands are those of docs/extending.md.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.shared.messages import Plan
from quadriga.shared.recording.reader import Recording
from tests.plugins.kinds import install_package
from tests.runtime.conftest import run_command

TOP = Path(__file__).parents[2]
PACKAGE = "tests/plugins/balance"


def documented_commands() -> list[list[str]]:
    """The lines of the shell blocks of the section on planners."""
    page = (TOP / "docs" / "extending.md").read_text(encoding="utf-8")
    section = re.split(r"^## ", page.partition("\n## A planner\n")[2], flags=re.MULTILINE)[0]
    blocks = re.findall(r"^```sh\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL)
    return [shlex.split(line, comments=True) for block in blocks for line in block.splitlines()]


class Place:
    """A folder in which the documented commands are typed, with the package installed beside it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.target = folder, folder / "installed"
        self._path = install_package("balance", folder)

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            words,
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": self._path},
            check=False,
            capture_output=True,
            text=True,
            timeout=500,
        )

    def quadriga(self, *words: str) -> subprocess.CompletedProcess[str]:
        return self.run(sys.executable, "-m", "quadriga", *words)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    return Place(tmp_path_factory.mktemp("plugin"))


@pytest.fixture(scope="module")
def said(place: Place) -> dict[str, str]:
    """What each documented command says, by its name; each of them succeeds."""
    install, export, *commands = documented_commands()
    assert (install[0], install[-1], export[0]) == ("pip", PACKAGE, "export")
    found = {}
    for program, command, *options in commands:
        assert program == "quadriga"
        done = place.quadriga(command, *options)
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        name = f"{command} --check" if "--check" in options else command
        found[name] = done.stdout
    return found


def test_the_documented_commands_know_it(place: Place, said: dict[str, str]) -> None:
    assert {*said} == {"walk", "info", "info --check", "replay", "campaign"}
    plans = [*Recording(place.folder / "runs" / "balance" / "run.mcap").messages(Plan, "r2")]
    assert len(plans) > 20
    assert any((abs(plan.u) > 0).any() for plan in plans)
    assert re.search(r"quadriga-balance 0\.1\.0 [0-9a-f]{16}", said["info"])
    assert "FAIL" not in said["info --check"]
    assert re.search(r"ok +delay +.*plans", said["info --check"])
    for robot in ("r1", "r2"):
        assert re.search(rf"{robot}: .*plan.* equal to the byte", said["replay"])
    rows = (place.folder / "runs" / "compared" / "trials.csv").read_text(encoding="utf-8")
    assert rows.count(",balance,") == rows.count(",none,") == 1
    assert "balance" in said["campaign"]


@pytest.mark.nightly
@pytest.mark.usefixtures("said")
def test_without_the_package_a_recording_says_what_is_missing(place: Place) -> None:
    recording = str(place.folder / "runs" / "balance" / "run.mcap")
    for words in (("info", "--check"), ("replay", "--all")):
        status, errors = run_command(*words, recording)
        assert status == 2
        assert "planner.kind = 'balance'" in errors
        assert "install the package that has it" in errors


def test_its_options_are_checked(place: Place) -> None:
    done = place.quadriga("config", "--planner", "balance", "--set", "planner.options=sped=3")
    assert done.returncode != 0
    assert "options of balance: speed, height, tilt (did you mean 'speed'?)" in done.stderr


@pytest.mark.nightly
def test_it_keeps_the_contract_of_all_planners(place: Place) -> None:
    test = str(TOP / "tests" / "plugins" / "test_contract.py")
    options = ("-vv", "-p", "no:cacheprovider", "-p", "no:xdist", "-k", "balance", "--rootdir")
    done = place.run(sys.executable, "-m", "pytest", *options, str(TOP), test)
    assert done.returncode == 0, done.stdout
    assert re.search(r"test_a_replay_is_exact\[0-balance\] PASSED", done.stdout)
    assert len(re.findall(r"balance\] PASSED", done.stdout)) >= 7


@pytest.mark.nightly
@pytest.mark.usefixtures("said")
def test_other_code_of_the_same_version_is_noticed(place: Place) -> None:
    """By a campaign, which does not go on with it, and by a replay, which differs and says why."""
    file = place.target / "quadriga_balance" / "planner.py"
    before = file.read_text(encoding="utf-8")
    after = before.replace("0.8 * errors + 0.2", "0.7 * errors + 0.3")
    assert after != before
    file.write_text(after, encoding="utf-8")
    done = place.quadriga(*documented_commands()[-1][1:])
    assert done.returncode != 0
    assert "trials of planner or controller quadriga-balance 0.1.0 " in done.stderr
    done = place.quadriga("replay", "runs/balance/run.mcap", "--robot", "r1")
    assert done.returncode == 1
    assert "first difference: " in done.stdout
    assert re.search(
        r"may be why: quadriga-balance 0\.1\.0 \w{16} \(here 0\.1\.0 \w{16}\)", done.stdout
    )
