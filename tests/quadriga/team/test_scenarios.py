"""Every scenario is a file that loads, says what it is, and is another world with another seed."""

from __future__ import annotations

import tomllib
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.commands.parser import main
from quadriga.identification.cache import predictor_key
from quadriga.recordings.summary import summarise
from quadriga.shared.codec import encode
from quadriga.shared.codes import FAULT_BEGINS
from quadriga.shared.config.load import build, layers, load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.reader import Recording
from quadriga.sim_server.world.world import World
from quadriga.team.operator import reference_at
from quadriga.team.scenarios import description, label, names, path
from quadriga.team.walk import check_walk
from tests.quadriga.conftest import WriteRun, run_config
from tests.sim_server.standing import SILENT

PROMISED = {
    "payload-uneven-5": 5, "blocks-3": 3, "gravel-3": 3, "push-3": 3, "joystick-3": 3,
    "payload-heavy-2": 2, "payload-heavy-4": 4, "asymmetric-5": 5, "chain-5": 5, "ring-5": 5,
    "ten": 10, "slope": 3, "low-friction": 3, "one-soft-leg": 3, "turn": 3,
    "flat": 3, "hard-blocks": 3, "hard-payload": 3, "hard-friction": 3, "hard-push": 3,
    "hard-motor": 3, "stairs": 3, "edge-blocks": 3, "edge-payload": 3, "edge-friction": 3,
    "edge-push": 3, "edge-motor": 3, "distribution-pushed": 3, "distribution-loaded": 3,
    "distribution-slipping": 3, "faulty-imu": 3,
}  # fmt: skip


def test_what_would_begin_after_the_end_of_a_walk_is_told() -> None:
    world = {"duration": 0.5, "push": "r1:50:90:99:0.2", "faults": "r2/imu off 0.1 5"}
    late = check_walk(build({"world": world}))
    assert [(event.kind, event.robot, event.tick) for event in late] == [("push", "r1", 99_000)]


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(arguments)
    return (status, *capsys.readouterr())


def test_all_that_are_promised_are_there() -> None:
    assert set(names()) == set(PROMISED)


@pytest.mark.parametrize("name", PROMISED)
def test_a_scenario_loads_and_names_only_what_is_not_the_default(name: str) -> None:
    config, default = load(path(name)), asdict(Config())
    assert config.team.robots == PROMISED[name]
    given: dict[str, dict[str, Any]] = tomllib.loads(path(name).read_text(encoding="utf-8"))
    same = [f"{s}.{k}" for s, keys in given.items() for k, v in keys.items() if v == default[s][k]]
    assert same == []
    text = description(name)
    assert "the paper" in text
    assert text.endswith(".")


@pytest.mark.parametrize("name", PROMISED)
def test_no_scenario_asks_for_a_predictor_of_its_own(name: str) -> None:
    """But for the size of the team and its yokes."""
    config = load(path(name))
    team = replace(Config().team, robots=config.team.robots, yokes=config.team.yokes)
    assert predictor_key(config) == predictor_key(replace(Config(), team=team))


@pytest.mark.parametrize("name", PROMISED)
def test_another_seed_is_another_world_even_without_sensor_noise(name: str) -> None:
    def told(seed: int) -> tuple[bytes, ...]:
        config = load(path(name), {"world.seed": seed, "world.duration": 8.0})
        world = World(replace(config, sensors=SILENT))
        events = b"".join(encode(event) for event in world._scenario.events)
        asked = b"".join(encode(reference_at(config, tick)) for tick in range(1000, 5000, 500))
        return encode(world.truth()), events, asked

    first, again, other = told(4), told(4), told(5)
    assert first == again
    assert first[0] != other[0]  # where the robots stand
    drawn = {"push-3", "one-soft-leg"} | {n for n in PROMISED if "payload" in n or n == "blocks-3"}
    if name in drawn:
        assert first[1] != other[1]
    assert (first[2] != other[2]) == (name == "joystick-3")


def test_a_scenario_may_have_sensors_and_motors_fail() -> None:
    world = World(load(path("faulty-imu")))
    events = [event for _, at in sorted(world._events.items()) for event in at]
    told = [(event.tick, event.robot) for event in events if event.code == FAULT_BEGINS]
    assert told == [(4000, "r2"), (7000, "r2"), (10_000, "r3")]


def test_a_scenario_lies_beneath_the_file_and_the_options(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "more.toml"
    file.write_text("[world]\npush_force = 120.0\nseed = 3\n", encoding="utf-8")
    given = ("--scenario", "push-3", "--config", str(file), "--seed", "9")
    status, out, _ = run(capsys, "config", *given)
    assert status == 0
    for line in ('scenario = "push-3"', "vx = 0.4", "push_force = 120.0", "seed = 9"):
        assert f"\n{line}\n" in out


def test_any_file_is_a_scenario(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("# Mine:\n# one robot.\n\n# not this\n[team]\nrobots = 1\n", encoding="utf-8")
    assert (description(str(file)), label(str(file))) == ("Mine: one robot.", "mine")
    status, out, _ = run(capsys, "config", "--scenario", str(file))
    assert status == 0
    assert "robots = 1\n" in out
    assert 'scenario = "mine"\n' in out


@pytest.mark.parametrize(
    ("name", "cause"),
    [("gravel", "did you mean 'gravel-3'?"), ("qqq", "`quadriga walk --list` lists them")],
)
def test_a_wrong_name_is_one_error_that_tells_the_right_one(
    capsys: pytest.CaptureFixture[str], name: str, cause: str
) -> None:
    status, out, err = run(capsys, "walk", "--scenario", name)
    assert (status, out) == (2, "")
    expected = "expected the name of a scenario, or a TOML file"
    assert err == f"quadriga: --scenario: got '{name}', {expected} ({cause})\n"


def test_a_file_that_is_not_there_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "walk", "--scenario", "/nowhere/mine.toml")
    assert status == 2
    assert "/nowhere/mine.toml: got No such file" in err


@pytest.mark.parametrize(
    ("text", "message"),
    [("world = 3\n", r"^world: "), ("[wrld]\nseed = 3\n", "did you mean 'world'")],
)
def test_a_file_over_a_scenario_is_checked_as_any(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=message):
        build(layers(file, {}, beneath=path("turn")))


def test_the_list_says_what_each_is(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "walk", "--list")
    assert status == 0
    for name in PROMISED:
        assert f"{name} " in out
    assert "60 %" in " ".join(out.split())


def test_a_walk_is_labelled_with_its_scenario(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    config = run_config(2, 0.5)
    folder = write_run(replace(config, world=replace(config.world, scenario="turn")))
    assert Recording(folder / "run.mcap").metadata["scenario"] == "turn"
    assert summarise(folder)["scenario"] == "turn"
    assert run(capsys, "info", str(folder / "run.mcap"))[0] == 0
    assert run(capsys, "report", str(folder / "run.mcap"))[1].count("robots, turn, seed") == 1
