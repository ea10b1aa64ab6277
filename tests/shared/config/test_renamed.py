"""Keys of an earlier version: one error for whoever writes them, no other hash, still read."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import cast

import pytest

from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.commands.parser import main
from quadriga.shared.config.later import LATER_KEYS, hashed_sections
from quadriga.shared.config.load import build, load
from quadriga.shared.config.renamed import (
    RENAMED,
    current_name,
    with_current_names,
    with_first_names,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording

PAIRS = pytest.mark.parametrize(("old", "new"), RENAMED.items())
KEYS = {
    f"{section.name}.{key.name}"
    for section in fields(Config)
    for key in fields(getattr(Config(), section.name))
}
# That of the preset "plain" when it was called "paper".
PLAIN_SHA256 = "584344a32dda3626a6d289e099c7c8324647bcaeb6e9b47d533ac656565439a5"
# The hash of all defaults under the names and with the values that keys had before any was renamed.
FIRST_NAMES_SHA256 = "1ef0cbe238d0ab9e18d4bba4d9a55d45aabc813083288aed69ec7899b1eb43d7"

# The values that all keys had then which have others today.
FIRST_VALUES = {
    **LATER_KEYS,
    "identification.predictor": "ridge",
    "identification.noise": (15.0, 15.0, 35.0),
    "identification.max_radius": 0.5,
    "planner.compensation": False,
    "planner.damping": 0.0,
}


@PAIRS
def test_a_new_name_is_a_key_and_an_old_one_is_none(old: str, new: str) -> None:
    assert new in KEYS
    assert old not in KEYS
    assert current_name(old) == current_name(new) == new


def test_no_two_keys_had_one_name() -> None:
    assert len({*RENAMED.values()}) == len(RENAMED)


@PAIRS
def test_an_old_name_in_a_file_is_one_error_that_names_the_new_one(
    tmp_path: Path, old: str, new: str
) -> None:
    section, _, key = old.partition(".")
    path = tmp_path / "team.toml"
    path.write_text(f"[{section}]\n{key} = 1\n")
    with pytest.raises(ConfigError) as caught:
        load(path)
    assert str(caught.value) == (
        f"{old}: got a name of an earlier version, expected {new} "
        "(the key was renamed, not changed)"
    )


@PAIRS
def test_so_is_one_on_the_command_line(
    capsys: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    assert main(["config", "--set", f"{old}=1"]) != 0
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert f"{old}: got a name of an earlier version, expected {new}" in lines[0]


def test_names_lead_there_and_back() -> None:
    now = asdict(load(None, {"controller.reflex_ms": 3}))
    first = with_first_names(now)
    assert first["controller"]["give_way_ms"] == 3
    assert not RENAMED.keys() & {f"controller.{key}" for key in with_current_names(first)}
    assert with_current_names(first) == with_current_names(now) == now
    assert with_first_names({"controller": 5}) == {"controller": 5}, "no section, left to the check"


class Metadata:
    """As much of a recording as its configuration is read from."""

    path = Path("run.mcap")

    def __init__(self, sections: object) -> None:
        self.metadata = {"config_json": json.dumps(sections)}


def test_a_recorded_configuration_of_an_earlier_version_is_read() -> None:
    config = load(None, {"controller.reflex_ms": 3, "controller.mu_min": 0.2})
    recording = Metadata(with_first_names(asdict(config)))
    assert "mu_least" in recording.metadata["config_json"]
    assert recorded_config(cast(Recording, recording)) == config


def test_a_value_of_an_earlier_version_is_read_wherever_it_stands(tmp_path: Path) -> None:
    plain = load(None, {"controller.preset": "plain"})
    path = tmp_path / "team.toml"
    path.write_text('[controller]\npreset = "paper"\n')
    assert load(path) == load(None, {"controller.preset": "paper"}) == plain
    first = with_first_names(asdict(plain))
    assert first["controller"]["preset"] == "paper"
    assert recorded_config(cast(Recording, Metadata(first))) == plain
    as_first = load(None, {**FIRST_VALUES, "controller.preset": "plain"})
    assert config_sha256(as_first) == PLAIN_SHA256
    planner = load(None, {"planner.preset": "paper"}).planner
    assert planner.preset == "paper", "another key's value of the same name"


def test_a_predictor_of_the_plain_low_level_is_one_of_the_first_name() -> None:
    meta = PredictorMeta.of(load(None, {"controller.preset": "plain"}))
    body = json.loads(json.dumps(meta.to_dict()))
    assert body["controller"]["preset"] == "paper"
    assert PredictorMeta.from_dict(body) == meta


def test_a_recorded_key_that_no_version_had_is_refused() -> None:
    with pytest.raises(RecordingError, match=r"controller\.leashes"):
        recorded_config(cast(Recording, Metadata({"controller": {"leashes": 1}})))


def test_a_new_name_changes_no_hash() -> None:
    """Of the configuration that does what the first one did, whatever is the default today."""
    config = load(None, FIRST_VALUES)
    body = {name: keys for name, keys in hashed_sections(asdict(config)).items() if name != "bus"}
    text = json.dumps(body, sort_keys=True, separators=(",", ":"))
    assert config_sha256(config) == hashlib.sha256(text.encode()).hexdigest() == FIRST_NAMES_SHA256
    assert config_sha256(build(asdict(config))) == FIRST_NAMES_SHA256
