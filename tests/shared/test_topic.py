"""A row that another package brings is a row like any other, or is refused with one clear error."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.topic import plugin_topics
from quadriga.shared.topics import TABLE

HEAD = """
from quadriga.shared.runtime.record import record
from quadriga.shared.messages import Message, State, plain
from quadriga.shared.topic import Topic

@record
class Smell(Message):
    strength: float = plain(float, "of what")

@record
class State(Message):
    strength: float = plain(float, "a type of this name is there already")

"""
Install = Callable[[str], str]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """A function that installs a distribution with one row; its module's name."""

    def put(row: str) -> str:
        name = f"smell_{tmp_path.name}"  # imported once in a process
        (tmp_path / f"{name}.py").write_text(f"{HEAD}ROW = {row}\n", encoding="utf-8")
        info = tmp_path / f"{name}-2.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 2.0\n")
        (info / "entry_points.txt").write_text(f"[quadriga.topics]\nsmell = {name}:ROW\n")
        monkeypatch.syspath_prepend(str(tmp_path))
        return name

    return put


def test_a_row_of_another_package_follows_the_own_ones(install: Install) -> None:
    name = install('Topic("smell", Smell, ("nose",), ("dog",), per_robot=True, period_ms=20)')
    (row,) = plugin_topics(TABLE)
    assert row.type.__module__ == name
    assert row.key("team", "r1") == "team/r1/smell"


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ('"smell"', "got 'smell', expected a Topic"),
        ('Topic("smell", int, (), (), period_ms=0)', "expected a Message"),
        ('Topic("state", Smell, (), (), period_ms=0)', "got 'state', expected a name of its own"),
        ('Topic("a b", Smell, (), (), period_ms=0)', "got 'a b', expected a name of its own"),
        ('Topic("smell", State, (), (), period_ms=0)', "got State, expected a message type with"),
        ('Topic("smell", Smell, (), (), period_ms=-1)', "period_ms -1, .*expected at least 0"),
        ('Topic("smell", Smell, (), ("agent",), period_ms=0)', "got agent, expected receivers of"),
        ("Smel", "got NameError: .*expected a row that can be imported"),
    ],
)
def test_another_row_is_refused_by_name(install: Install, row: str, message: str) -> None:
    name = install(row)
    with pytest.raises(ConfigError, match=message) as error:
        plugin_topics(TABLE)
    assert f"entry point smell = {name}:ROW in quadriga.topics of {name} 2.0" in str(error.value)


def test_it_costs_a_command_one_line(install: Install, tmp_path: Path) -> None:
    install("None")
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-m", "quadriga", "version"],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("quadriga: entry point smell = ")
