"""A row that another package brings is a row like any other, or is refused with one clear error."""

from __future__ import annotations

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
    ("row", "got"),
    [
        ('"smell"', "'smell'"),
        ('Topic("smell", int, (), (), period_ms=0)', "<class 'int'>"),
        ('Topic("state", Smell, (), (), period_ms=0)', "'state'"),
        ('Topic("a b", Smell, (), (), period_ms=0)', "'a b'"),
        ('Topic("smell", State, (), (), period_ms=0)', "State"),
        ('Topic("smell", Smell, (), (), period_ms=-1)', "period_ms -1, max_age_ms 0"),
        ('Topic("smell", Smell, (), ("agent",), period_ms=0)', "agent"),
        ("Smel", "NameError: name 'Smel' is not defined"),
    ],
)
def test_another_row_is_refused_by_name(install: Install, row: str, got: str) -> None:
    name = install(row)
    with pytest.raises(ConfigError) as error:
        plugin_topics(TABLE)
    assert error.value.name == f"entry point smell = {name}:ROW in quadriga.topics of {name} 2.0"
    assert error.value.got.startswith(got)
