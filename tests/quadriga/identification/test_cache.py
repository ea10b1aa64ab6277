"""Cache keys change with what they depend on, and with nothing else."""

from __future__ import annotations

from dataclasses import fields, replace
from importlib.util import find_spec
from pathlib import Path
from threading import Timer
from typing import Any

import pytest

from quadriga.identification import cache
from quadriga.identification.behaviour import behaviour
from quadriga.identification.cache import await_predictor, data_key, predictor_key
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.runtime.places import cache_dir

ALL = [
    f"{section.name}.{key.name}"
    for section in fields(Config)
    for key in fields(getattr(Config(), section.name))
]
# What a collected walk depends on: by section all keys but those named, or only those named.
SECTIONS = ("sensors", "motors", "estimator", "gait", "controller")
WALKED = {
    *(name for name in ALL if name.split(".")[0] in SECTIONS),
    "team.robots", "team.robot", "team.yokes", "team.spacing", "team.alternate_phase",
    "reference.height", "planner.interface",
    # As long as the length of the collection follows from the rule:
    "planner.N", "planner.T_ini",
    *(name for name in ALL if name.startswith("identification.")),
}  # fmt: skip
FITTED = {
    f"identification.{k}"
    for k in (
        "preset",
        "predictor",
        "neighbours",
        "ridge",
        "block_weight",
        "max_radius",
        "max_peers_harm",
        "gain_range",
        "response",
    )
}
WALKED -= FITTED
# What the fit and its gates depend on besides the data.
FITTED |= {f"planner.{key}" for key in ("N", "T_ini", "interface")}


def another(value: Any, choices: tuple[str, ...]) -> Any:
    """A value other than `value`, of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, tuple):
        return (*value[:-1], value[-1] + 0.125)
    if isinstance(value, str):
        return next((choice for choice in choices if choice != value), value + "x")
    return value + (1 if isinstance(value, int) else 0.125)


def changed(config: Config, name: str) -> Config:
    section_name, _, key = name.partition(".")
    section = getattr(config, section_name)
    item = next(item for item in fields(section) if item.name == key)
    value = another(getattr(section, key), item.metadata["choices"])
    return replace(config, **{section_name: replace(section, **{key: value})})


@pytest.mark.parametrize("section", [item.name for item in fields(Config)])
def test_keys_change_with_what_they_depend_on_and_with_that_alone(section: str) -> None:
    """Every key of the configuration in turn; a new key must find its place here."""
    config = Config()
    data, predictor = data_key(config), predictor_key(config)
    for name in ALL:
        if name.partition(".")[0] != section:
            continue
        other = changed(config, name)
        assert other != config
        assert (data_key(other) != data) == (name in WALKED), name
        assert (predictor_key(other) != predictor) == (name in WALKED | FITTED), name


def test_no_two_changes_share_a_key() -> None:
    keys = [predictor_key(changed(Config(), name)) for name in sorted(WALKED | FITTED)]
    assert len(set(keys)) == len(keys)


def test_the_horizon_does_not_touch_data_of_a_given_length() -> None:
    """`identification.seconds` set: the same walks serve any horizon, each with its own fit."""
    config = Config()
    config = replace(config, identification=replace(config.identification, seconds=100.0))
    for name in ("planner.N", "planner.T_ini"):
        assert data_key(changed(config, name)) == data_key(config)
        assert predictor_key(changed(config, name)) != predictor_key(config)


def test_the_same_configuration_has_the_same_key() -> None:
    assert data_key(Config()) == data_key(Config())
    assert predictor_key(Config()) == predictor_key(Config())
    assert data_key(Config()) != predictor_key(Config())


@pytest.mark.parametrize(("part", "predictor_alone"), [("collection", False), ("fits", True)])
def test_keys_change_with_what_the_code_does(
    part: str, predictor_alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, predictor = data_key(Config()), predictor_key(Config())
    asked: list[str] = []

    def other(module: str) -> str:
        asked.append(module)
        return "other" if module.endswith(part) else behaviour(module)

    monkeypatch.setattr(cache, "behaviour", other)
    assert (data_key(Config()) == data) == predictor_alone
    assert predictor_key(Config()) != predictor
    assert all(find_spec(name) for name in asked)


def test_the_cache_is_the_users(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_dir() == tmp_path / "quadriga"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_dir() == tmp_path / "home" / ".cache" / "quadriga"


def test_a_predictor_that_another_process_makes_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "predictor.npz"
    writer = Timer(0.3, path.touch)
    writer.start()
    await_predictor(path, 30.0)
    writer.join()
    assert path.is_file()


def test_a_predictor_that_nobody_makes_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(PredictorError, match=r"after 0\.1 s") as caught:
        await_predictor(tmp_path / "predictor.npz", 0.1)
    assert str(tmp_path) in caught.value.name
