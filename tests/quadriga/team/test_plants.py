"""The kinds of plant: the simulated world, and what installed packages add."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.sim_server.world.world import World
from quadriga.team.plants import plant_factory, plant_kinds

EACH = {"team.robots": 2, "team.plant_per_robot": True, "world.mode": "realtime"}


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A package that adds two kinds, as pip leaves it behind; one of them leads nowhere."""
    folder = tmp_path / "kennel-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: kennel\nVersion: 1.0\n")
    (folder / "entry_points.txt").write_text("[quadriga.plants]\ndog = kennel:Dog\ncat = no:Cat\n")
    (tmp_path / "kennel.py").write_text("class Dog: ...\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    sys.modules.pop("kennel", None)


def test_the_usual_plant_is_the_simulated_world() -> None:
    assert plant_factory(load()) is World


@pytest.mark.usefixtures("installed")
def test_an_installed_package_adds_a_kind() -> None:
    assert plant_kinds() == ("mujoco", "robots", "cat", "dog")
    assert plant_factory(load(None, {"team.plant": "dog"})).__name__ == "Dog"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("dgo", "got 'dgo', expected one of mujoco, robots, cat, dog (did you mean 'dog'?)"),
        ("go2", "one of mujoco, robots, cat, dog (is the package that adds it installed here?)"),
        ("cat", "got 'cat': No module named 'no', expected what no:Cat names"),
    ],
)
def test_a_kind_that_is_not_there_is_one_error(kind: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        plant_factory(load(None, {"team.plant": kind}))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "team.plant_per_robot: got true with simulated robots and 'complete' yokes"),
        ({"team.yokes": "none", "estimator.kind": "truth"}, "estimator.kind: got 'truth' with"),
    ],
)
def test_what_plants_of_one_robot_cannot_do_is_refused(keys: dict[str, str], words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load(None, {**EACH, **keys})
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "keys",
    [
        {"team.yokes": "none"},
        {"team.robots": 1},
        {"team.plant": "robots"},  # real robots are yoked whoever commands them
    ],
)
def test_plants_of_one_robot_walk_unyoked_alone_or_for_real(keys: dict[str, object]) -> None:
    assert load(None, {**EACH, **keys}).team.plant_per_robot
