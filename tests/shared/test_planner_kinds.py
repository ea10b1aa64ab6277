"""Kinds of planner: those of other packages are found, and what is wrong with one is one error."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from quadriga.agents.planning.registry import build_planning
from quadriga.shared.config.load import load
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import (
    BUILT_IN,
    find_kind,
    installed_kinds,
    load_builder,
    plugin_origin,
    read_options,
)
from tests.plugins.kinds import install_kind, install_module

LOCAL = "'quadriga.agents.planning.local:LocalPlanning'"


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_builder_of_a_built_in_kind_is_there(name: str) -> None:
    kind = find_kind(name)
    for reference in filter(None, (kind.build, kind.build_team)):
        assert callable(load_builder(kind, reference))
    assert plugin_origin(name) == ""


def test_a_plugin_is_a_kind_like_any_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = installed_kinds()
    install_kind(tmp_path, monkeypatch, "other", f"{LOCAL}, needs_peers=True")
    install_module(tmp_path, monkeypatch, "asleep", "raise RuntimeError('imported')")
    config = load(None, {"planner.kind": "other"})
    assert config_sha256(config) != config_sha256(load(None, {}))
    assert {*installed_kinds()} == {*before, "other", "asleep"}, "and none is imported"
    assert find_kind("other").agents_predict
    assert plugin_origin("other").startswith("quadriga-other 1.2 ")


@pytest.mark.parametrize(
    "text",
    [
        "import no_such_library",
        "KIND = 3",
        "from quadriga.shared.planner_kinds import BUILT_IN\nKIND = BUILT_IN['none']",
    ],
)
def test_a_plugin_that_cannot_be_used_names_its_distribution(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.delitem(sys.modules, "quadriga_lame_module", raising=False)
    install_module(tmp_path, monkeypatch, "lame", text)
    with pytest.raises(ConfigError, match=r"^planner\.kind: got .* of quadriga-lame 1\.2"):
        load(None, {"planner.kind": "lame"})
    for name, hint in (("telepathy", "install the package"), ("decentralized", "did you mean")):
        with pytest.raises(ConfigError, match=rf"^planner\.kind: got '{name}'.*{hint}"):
            load(None, {"planner.kind": name})


def test_so_does_a_builder_that_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_kind(tmp_path, monkeypatch, "headless", "'nowhere:Planner', needs_predictor=False")
    config = load(None, {"planner.kind": "headless"})
    words = r"'headless', whose nowhere:Planner of quadriga-headless 1\.2 raises ModuleNotFound"
    with pytest.raises(ConfigError, match=words):
        build_planning(config, 0, None, lambda: 0)


def test_two_packages_with_one_kind_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for owner in ("one", "two"):
        install_module(tmp_path, monkeypatch, "twice", "KIND = None", owner)
    with pytest.raises(ConfigError, match=r"'twice' of one 1\.2 and of two 1\.2, expected one"):
        load(None, {"planner.kind": "twice"})


def test_options_are_numbers_that_the_kind_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_kind(tmp_path, monkeypatch, "tuned", f"{LOCAL}, options={{'gain': 2.0, 'lead': 0.5}}")
    kind = find_kind("tuned")
    config = load(None, {"planner.kind": "tuned", "planner.options": "lead=1e-1"})
    assert read_options(kind, config.planner.options) == {"gain": 2.0, "lead": 0.1}
    assert [*config.planner.option_values] == ["gain", "lead"]
    for text, words in (
        ("gian=1", r"options of tuned: gain, lead \(did you mean 'gain'\?\)"),
        ("gain", r"got 'gain', expected gain=NUMBER"),
        ("gain=inf", r"gain=NUMBER, a finite one"),
        ("gain=1 gain=2", "got gain twice"),
    ):
        with pytest.raises(ConfigError, match=f"planner.options: .*{words}"):
            load(None, {"planner.kind": "tuned", "planner.options": text})
    with pytest.raises(ConfigError, match="options of distributed: it has none"):
        load(None, {"planner.options": "gain=1"})


def test_other_code_has_another_origin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install_kind(tmp_path, monkeypatch, "edited", LOCAL)
    before = plugin_origin("edited")
    module = tmp_path / "quadriga_edited_module.py"
    module.write_text(module.read_text(encoding="utf-8") + "# more\n", encoding="utf-8")
    after = plugin_origin("edited")
    assert before != after
    assert before.rpartition(" ")[0] == after.rpartition(" ")[0] == "quadriga-edited 1.2"
