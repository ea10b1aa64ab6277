"""A wrong configuration gives one error that names key, value and what is permitted."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from quadriga.shared.config.load import build, load, parse_assignment
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256, to_markdown, to_toml
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.places import SOURCE

KEYS = [
    (section.name, item)
    for section in fields(Config)
    for item in fields(section.default_factory)  # type: ignore[arg-type]
]
every_key = pytest.mark.parametrize(
    ("section", "item"), KEYS, ids=[f"{section}.{item.name}" for section, item in KEYS]
)


def write(folder: Path, text: str) -> Path:
    path = folder / "team.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_no_file_gives_every_default() -> None:
    assert load() == Config()


def test_file_then_overrides(tmp_path: Path) -> None:
    path = write(tmp_path, "[team]\nrobots = 5\n[world]\nseed = 7\nduration = 3\n")
    config = load(path, {"team.robots": 2, "reference.vx": 0.25})
    assert (config.team.robots, config.world.seed, config.reference.vx) == (2, 7, 0.25)
    assert type(config.world.duration) is float


def test_a_mark_of_the_byte_order_is_no_key(tmp_path: Path) -> None:
    path = tmp_path / "team.toml"
    path.write_text("[team]\nrobots = 5\n", encoding="utf-8-sig")
    assert load(path).team.robots == 5


def test_what_is_written_loads_as_the_same(tmp_path: Path) -> None:
    config = load(None, {"team.robots": 4, "world.push": "r1:80:90:5:0.2", "planner.Q": [1] * 6})
    again = load(write(tmp_path, to_toml(config)))
    assert again == config
    assert config_sha256(again) == config_sha256(config) != config_sha256(Config())


def test_a_preset_replaces_defaults_but_not_what_is_given(tmp_path: Path) -> None:
    path = write(tmp_path, '[controller]\npreset = "plain"\nkp_z = 333.0\n')
    controller = load(path).controller
    assert (controller.kp_z, controller.kp_tilt, controller.contact_detection) == (333, 400, False)


def test_a_preset_on_top_of_a_file_with_every_key(tmp_path: Path) -> None:
    path = write(tmp_path, to_toml(load(None, {"controller.mu": 0.5})))
    config = load(path, {"controller.preset": "soft", "controller.kd_xy": 7.0})
    assert config == load(
        None, {"controller.preset": "soft", "controller.kd_xy": 7.0, "controller.mu": 0.5}
    )
    assert config.controller.kp_z == 100.0


def test_the_hash_is_blind_to_the_network_alone() -> None:
    default = config_sha256(Config())
    assert config_sha256(load(None, {"bus.endpoint": "tcp/127.0.0.1:9"})) == default
    assert config_sha256(load(None, {"world.seed": 1})) != default


@every_key
def test_every_key_refuses_another_type(section: str, item: Any) -> None:
    wrong: list[Any] = [None, {"a": 1}, [[]]]
    wrong += [1.5, "1"] if type(item.default) is int else []
    wrong += ["1", float("nan"), float("inf"), True, 10**400] if type(item.default) is float else []
    wrong += [1, "true"] if type(item.default) is bool else []
    wrong += [[*item.default, 1.0], item.default[:-1]] if type(item.default) is tuple else []
    wrong += [1, True, "line\nbreak"] if type(item.default) is str else []
    for value in wrong:
        with pytest.raises(ConfigError, match=rf"{section}\.{item.name}\b.*expected"):
            load(None, {f"{section}.{item.name}": value})


@every_key
def test_every_key_keeps_its_range_and_has_a_plausible_default(section: str, item: Any) -> None:
    meta, name = item.metadata, f"{section}.{item.name}"
    assert meta["doc"]
    assert meta["unit"]
    for limit, outward in ((meta["low"], -1), (meta["high"], 1)):
        if limit is None:
            continue
        value = limit + outward * max(1.0, abs(limit))
        value = int(value) if type(item.default) is int else value
        wrong = [value] * len(item.default) if type(item.default) is tuple else value
        with pytest.raises(ConfigError, match=rf"{section}\.{item.name}"):
            load(None, {name: wrong})
    if meta["choices"]:
        assert item.default in meta["choices"]
        with pytest.raises(ConfigError, match=f"one of {meta['choices'][0]}"):
            load(None, {name: "something else"})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[wrld]\n", "wrld.*did you mean 'world'"),
        ("[world]\nsed = 1\n", r"world\.sed.*did you mean 'world\.seed'"),
        ("robots = 3\n", "robots.*a section"),
        ("world = 3\n", r"world: got 3, expected a section, written \[world\]"),
        ("[world\n", r"team\.toml.*line 1.*expected TOML"),
        ("[world]\nseed = 1\nseed = 2\n", r"team\.toml.*expected TOML"),
        ('[world]\nterrain = "boxs"\n', "did you mean 'boxes'"),
        ("[gait]\nstance_ms = 205\n", r"gait\.stance_ms: got 205, expected a multiple of 10 ms"),
        ("[gait]\nstand_ms = 333\n", r"gait\.stand_ms"),
        ('[world]\npayload_on = "r4"\n', r"world\.payload_on: got 'r4', expected 'team' or one of"),
        ('[world]\npush = "all:9:0:1:1,r7:9:0:1:1"\n', r"world\.push: got a push on 'r7'"),
        ("[world]\ncommand_hold_ms = 300\n", r"world\.command_damp_ms"),
        ("[planner]\nN = 4\napplied = 5\n", r"planner\.applied"),
        ("[planner]\nlatency_ms = 90\nN = 12\n", r"planner\.latency_ms: got 90, .* = 80 ms"),
        (
            '[planner]\nkind = "deepc"\nlatency_ms = 0\nN = 4\n',
            r"planner\.latency_ms: got 0, .* = 0",
        ),
        ("[planner]\npeer_timeout = 9.5\n", r"world\.command_timeout: got 10, .* = 10\.5 s"),
        (
            '[world]\nterrain = "pebbles"\nterrain_height = 0.0049\n',
            r"world\.terrain_height: got 0\.0049, expected at least 0\.005 m for",
        ),
        ('[world]\nterrain = "pebbles"\nterrain_height = 0\n', r"world\.terrain_height: got 0, "),
        ("[identification]\nvx = [0.5, -0.5]\n", r"identification\.vx.*\[least, greatest\]"),
        ("[planner]\nR = [0.2, 0.2, -1.0]\n", r"planner\.R\[2\].*≥ 1e-09"),
        ("[world]\nfriction = 9\n", r"world\.friction: got 9, expected a finite number in \[0.05"),
        ("[motors]\nrotor_inertia = false\n", r"motors\.rotor_inertia: got false with .* 0\.4"),
        ("[team]\nspacing = 9.0\n", r"team\.spacing.*\[m\]"),
    ],
)
def test_a_mistake_in_the_file_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load(write(tmp_path, text))


@pytest.mark.parametrize(
    "text",
    [
        "[planner]\nlatency_ms = 80\nN = 12\n",
        "[planner]\nlatency_ms = 0\nN = 4\n",
        '[planner]\nkind = "none"\nlatency_ms = 90\nN = 12\npeer_timeout = 10.0\n',
        "[planner]\npeer_timeout = 9.0\n",
        '[planner]\npeer_timeout = 10.0\n[world]\nmode = "realtime"\n',
        '[world]\nterrain = "pebbles"\nterrain_height = 0.005\n',
        "[world]\nterrain_height = 0.0\n",
    ],
)
def test_what_fits_together_is_taken(tmp_path: Path, text: str) -> None:
    load(write(tmp_path, text))


@pytest.mark.parametrize("name", ["", "a/b", "*", "**", "a b", "ä", "x" * 65, "$*", "#"])
def test_a_team_name_is_one_chunk_of_a_key(name: str) -> None:
    with pytest.raises(ConfigError, match=r"team\.name"):
        load(None, {"team.name": name})


def test_an_absent_or_binary_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"absent\.toml: got No such file"):
        load(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="UTF-8"):
        load(tmp_path / "binary.toml")


@pytest.mark.parametrize("name", ["world", "world.", "nothing.at_all"])
def test_an_override_must_name_a_key(name: str) -> None:
    with pytest.raises(ConfigError):
        load(None, {name: 1})


def test_assignments_on_the_command_line() -> None:
    assert parse_assignment("controller.kp_z=300") == ("controller.kp_z", 300)
    assert parse_assignment("planner.R = [1, 2, 3]") == ("planner.R", [1, 2, 3])
    assert parse_assignment("world.terrain=boxes") == ("world.terrain", "boxes")
    with pytest.raises(ConfigError, match=r"section\.key=value"):
        parse_assignment("world.terrain")


def test_the_committed_page_is_in_step_with_the_code() -> None:
    page = SOURCE / "docs" / "configuration.md"
    assert page.read_text(encoding="utf-8") == to_markdown(Config())


def test_a_robots_own_values_stand_beneath_what_is_given() -> None:
    assert load(None, {"team.robot": "go2"}).reference.height == 0.28
    assert load(None, {"team.robot": "go2", "reference.height": 0.25}).reference.height == 0.25
    assert load().reference.height == 0.26


def test_a_robot_has_the_sensors_of_its_record_unless_others_are_asked_for() -> None:
    go2 = load(None, {"team.robot": "go2", "sensors.foot_refresh_rate": 500.0}).sensors
    assert (go2.foot_scale, go2.foot_offset, go2.foot_refresh_rate) == (0.65, 15.0, 500.0)
    go1 = load(None, {"team.robot": "go1"}).sensors
    assert (go1.foot_scale, go1.foot_scale_spread, go1.foot_offset) == (12.5, 0.06, 120.0)
    ideal = load(None, {"team.robot": "go1", "sensors.preset": "ideal"}).sensors
    assert (ideal.foot_sensor, ideal.foot_force, ideal.accel_bias) == ("newtons", 1.0, 0.02)


def test_a_team_of_different_robots_is_refused_with_the_reason() -> None:
    with pytest.raises(ConfigError, match=r"'a1,go2'.*one of a1, go1, go2.*of one kind"):
        load(None, {"team.robot": "a1,go2"})


NINES = "9" * 5000


@pytest.mark.parametrize(
    "value",
    [NINES, "[" * 3000 + "]" * 3000, "{a=" * 3000 + "1" + "}" * 3000, "0x" + "f" * 5000],
    ids=["digits", "brackets", "tables", "hexadecimal"],
)
@pytest.mark.parametrize("key", ["world.seed", "planner.Q", "team.name", "controller.preset"])
def test_a_value_without_end_is_one_short_error(tmp_path: Path, key: str, value: str) -> None:
    section, _, name = key.partition(".")
    with pytest.raises(ConfigError) as typed:
        load(None, dict([parse_assignment(f"{key}={value}")]))
    with pytest.raises(ConfigError) as written:
        load(write(tmp_path, f"[{section}]\n{name} = {value}\n"))
    for error in (typed.value, written.value):
        assert len(str(error)) < 700
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    "value", [int(NINES[:4000]) ** 2, [[[0] * 3] * 3] * 90], ids=["digits", "lists"]
)
def test_a_value_of_a_recording_without_end_is_one_short_error(value: object) -> None:
    for section in ({"seed": value}, value):
        with pytest.raises(ConfigError) as caught:
            build({"world": section})
        assert len(str(caught.value)) < 700


@pytest.mark.parametrize(
    ("text", "got"),
    [
        (".".join("a" * 50_000) + " = 1\n", "a key of more than 100 parts"),
        ("[" + " . ".join(['"\\""', "'b'"] * 500) + "]\n", "a key of more than 100 parts"),
        ("#" * 5_000_000, "more than 4,194,304 bytes"),
    ],
)
def test_a_file_that_would_take_the_memory_is_refused_before_it_is_parsed(
    tmp_path: Path, text: str, got: str
) -> None:
    (tmp_path / "team.toml").write_text(text)
    with pytest.raises(ConfigError, match=got):
        load(tmp_path / "team.toml")
    longest = '[reference]\ntrace = "' + "0.5 0.25 0.1 0.0;" * 1000 + '"\n'
    (tmp_path / "team.toml").write_text(longest)
    assert len(load(tmp_path / "team.toml").reference.trace) == 17_000
