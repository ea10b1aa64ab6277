"""A wrong configuration gives one error that names key, value and what is permitted."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from quadriga.shared.config.load import build, layers, load, parse_assignment
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import agreed_keys, config_sha256, to_toml
from quadriga.shared.errors import ConfigError
from quadriga.team import scenarios

PROGRAM = "python walk.py"


def write(folder: Path, text: str) -> Path:
    path = folder / "team.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refused(keys: dict[str, Any]) -> str:
    """The name of what an error about these keys is about."""
    with pytest.raises(ConfigError) as caught:
        load(None, keys)
    return caught.value.name.partition("[")[0]


def test_overrides_stand_on_the_file_and_that_on_the_defaults(tmp_path: Path) -> None:
    assert load() == Config()
    path = write(tmp_path, "\ufeff[team]\nrobots = 5\n[world]\nseed = 7\nduration = 3\n")
    config = load(path, {"team.robots": 2, "reference.vx": 0.25})
    assert (config.team.robots, config.world.seed, config.reference.vx) == (2, 7, 0.25)
    assert type(config.world.duration) is float


def test_what_is_written_loads_as_the_same(tmp_path: Path) -> None:
    config = load(None, {"team.robots": 4, "world.push": "r1:80:90:5:0.2", "planner.Q": [1] * 6})
    again = load(write(tmp_path, to_toml(config)))
    assert again == config
    assert config_sha256(again) == config_sha256(config) != config_sha256(Config())
    assert config_sha256(load(None, {"bus.endpoint": "tcp/127.0.0.1:9"})) == config_sha256(Config())


def test_a_preset_replaces_what_a_file_says_of_its_keys_and_nothing_else(tmp_path: Path) -> None:
    path = write(tmp_path, '[controller]\npreset = "plain"\nkp_z = 333.0\n')
    controller = load(path).controller
    assert (controller.kp_z, controller.kp_tilt, controller.contact_detection) == (333, 400, False)
    path = write(tmp_path, to_toml(load(None, {"controller.mu": 0.5})))
    keys = {"controller.preset": "soft", "controller.kd_xy": 7.0}
    assert load(path, keys) == load(None, {**keys, "controller.mu": 0.5})
    assert load(path, keys).controller.kp_z == 100.0


def test_a_robots_own_values_stand_beneath_presets_and_what_is_given() -> None:
    given = {"team.robot": "go2", "sensors.foot_refresh_rate": 500.0}
    config = load(None, given)
    assert (config.reference.height, load().reference.height) == (0.28, 0.26)
    assert (config.sensors.foot_scale, config.sensors.foot_refresh_rate) == (0.65, 500.0)
    assert load(None, given | {"sensors.preset": "ideal"}).sensors.accel_bias == 0.02


def test_a_program_of_ones_own_takes_the_place_of_the_planner(tmp_path: Path) -> None:
    given = {"team.agent_command": PROGRAM}
    hard = build(layers(None, given, beneath=scenarios.path("hard-blocks")))
    assert (hard.planner.kind, hard.world.terrain) == ("none", "boxes")
    config = load(write(tmp_path, to_toml(Config())), given)
    assert config.planner.kind == "none"
    assert load(write(tmp_path, to_toml(config))) == config
    assert refused({**given, "planner.kind": "deepc"}) == "planner.kind"
    assert refused({"team.agent_command": "walk {robots}"}) == "team.agent_command"


@pytest.mark.parametrize("section", [item.name for item in fields(Config)])
def test_every_key_refuses_another_type_and_what_is_out_of_range(section: str) -> None:
    for item in fields(getattr(Config(), section)):
        default: Any = item.default
        meta, name = item.metadata, f"{section}.{item.name}"
        assert meta["doc"]
        assert meta["unit"]
        others: dict[type, list[Any]] = {
            int: [1.5, "1"],
            float: ["1", math.nan, math.inf, True, 10**400],
            bool: [1, "true"],
            str: [1, True, "line\nbreak"],
            tuple: [[*default, 1.0], default[:-1]] if type(default) is tuple else [],
        }
        wrong = [None, {"a": 1}, [[]], *others[type(default)]]
        for limit, outward in ((meta["low"], -1), (meta["high"], 1)):
            if math.isfinite(limit):
                value = type(limit)(limit + outward * max(1.0, abs(limit)))
                wrong.append([value] * len(default) if type(default) is tuple else value)
        for value in (*wrong, *(["something else"] if meta["choices"] else [])):
            assert refused({name: value}) == name


EACH = '[world]\nmode = "realtime"\n'


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("[wrld]\n", "wrld"),
        ("[world]\nsed = 1\n", "world.sed"),
        ("robots = 3\n", "robots"),
        ("world = 3\n", "world"),
        ('[team]\nname = "a/b"\n', "team.name"),
        ('[bus]\nendpoint = "tcp/127.0.0.1:0"\n', "bus.endpoint"),
        ("[gait]\nstance_ms = 205\n", "gait.stance_ms"),
        ('[world]\npayload_on = "r4"\n', "world.payload_on"),
        ('[world]\nfriction_of = "r4:0.3"\n', "world.friction_of"),
        ('[world]\npush = "all:9:0:1:1,r7:9:0:1:1"\n', "world.push"),
        ("[world]\ncommand_hold_ms = 300\n", "world.command_damp_ms"),
        ("[planner]\nN = 4\napplied = 5\n", "planner.applied"),
        ("[planner]\nlatency_ms = 90\nN = 12\n", "planner.latency_ms"),
        ('[planner]\nkind = "deepc"\nlatency_ms = 0\nN = 4\n', "planner.latency_ms"),
        ('[planner]\nkind = "none"\noptions = "a=1"\n', "planner.options"),
        ("[planner]\ndamping = -0.5\n", "planner.damping"),
        ('[planner]\ncost = "team"\noutput_bounds = "hard"\n', "planner.output_bounds"),
        ("[world]\ncommand_timeout = 5.9\n", "world.command_timeout"),
        ('[world]\nterrain = "pebbles"\nterrain_height = 0.0049\n', "world.terrain_height"),
        ("[identification]\nvx = [0.5, -0.5]\n", "identification.vx"),
        ('[identification]\npredictor = "pinv"\nresponse = "a"\n', "identification.response"),
        ("[motors]\nrotor_inertia = false\n", "motors.rotor_inertia"),
        ('[team]\nplant = "robots"\n', "team.plant_per_robot"),
        ('[team]\nplant = "robots"\nplant_per_robot = true\n', "world.mode"),
        ("[team]\nplant_per_robot = true\n", "world.mode"),
        (f"{EACH}[team]\nplant_per_robot = true\n", "team.plant_per_robot"),
        (
            f'{EACH}[team]\nplant_per_robot = true\nyokes = "none"\n[estimator]\nkind = "truth"\n',
            "estimator.kind",
        ),
        ("[planner]\nlatency_ms = 80\nN = 12\n", ""),
        ("[planner]\nlatency_ms = 0\nN = 4\n", ""),
        ('[planner]\nkind = "none"\nlatency_ms = 90\nN = 12\n[world]\ncommand_timeout = 1\n', ""),
        ("[world]\ncommand_timeout = 6.0\n", ""),
        (f"{EACH}command_timeout = 1\n", ""),
        ('[world]\nterrain = "pebbles"\nterrain_height = 0.005\n', ""),
        ("[world]\nterrain_height = 0.0\n", ""),
    ],
)
def test_a_mistake_or_contradiction_in_the_file_is_named(
    tmp_path: Path, text: str, name: str
) -> None:
    path = write(tmp_path, text)
    if not name:
        load(path)
        return
    with pytest.raises(ConfigError) as caught:
        load(path)
    assert caught.value.name == name


def test_a_name_that_is_like_another_is_hinted_at() -> None:
    for name, value, meant in (("world.sed", 1, "world.seed"), ("world.terrain", "boxs", "boxes")):
        with pytest.raises(ConfigError) as caught:
            load(None, {name: value})
        assert caught.value.cause == f"did you mean {meant!r}?"


def test_assignments_on_the_command_line() -> None:
    assert parse_assignment("controller.kp_z=300") == ("controller.kp_z", 300)
    assert parse_assignment("planner.R = [1, 2, 3]") == ("planner.R", [1, 2, 3])
    assert parse_assignment("world.terrain=boxes") == ("world.terrain", "boxes")
    with pytest.raises(ConfigError):
        parse_assignment("world.terrain")
    assert refused({"robots": 3}) == "robots"


@pytest.mark.parametrize("value", ["9" * 5000, "[" * 3000 + "]" * 3000, "0x" + "f" * 5000])
@pytest.mark.parametrize("key", ["world.seed", "planner.Q", "team.name"])
def test_a_value_without_end_is_one_short_error(tmp_path: Path, key: str, value: str) -> None:
    section, _, name = key.partition(".")
    with pytest.raises(ConfigError) as typed:
        load(None, dict([parse_assignment(f"{key}={value}")]))
    with pytest.raises(ConfigError) as written:
        load(write(tmp_path, f"[{section}]\n{name} = {value}\n"))
    for error in (typed.value, written.value):
        assert len(str(error)) < 700
        assert "\n" not in str(error)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for path in (write(tmp_path, "[world\n"), tmp_path / "none.toml", tmp_path):
        with pytest.raises(ConfigError) as caught:
            load(path)
        assert caught.value.name == str(path)


def test_a_file_that_would_take_the_memory_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="more than 4,194,304 bytes"):
        load(write(tmp_path, "#" + "ä" * 2_500_000))


@pytest.mark.parametrize(
    ("key", "value", "is_own"),
    [
        ("bus.endpoint", "tcp/10.0.0.1:7447", True),
        ("runtime.priority", "ordinary", True),
        ("bridge.interface", "eth1", True),
        ("world.scenario", "mine", True),
        ("world.seed", 4, False),
        ("controller.mu", 0.5, False),
        ("bridge.torque_share", 0.5, False),
        ("bus.clock_timeout", 0.6, False),
        ("recorder.enabled", False, False),
        ("reference.trace", "t,vx,vy,wz;" + "".join(f"{t},0.1,0,0;" for t in range(50)), False),
    ],
)
def test_processes_must_agree_on_all_but_what_is_a_computers_own(
    key: str, value: object, *, is_own: bool
) -> None:
    said = agreed_keys(load(None, {key: value}))
    differing = {line.partition("=")[0] for line in {*said} ^ {*agreed_keys(Config())}}
    assert differing == (set() if is_own else {key})
    assert all(len(line) < 150 for line in said)
