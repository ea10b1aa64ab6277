"""A user's mistake costs one line on stderr and exit status 2, never a traceback."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.commands.command_table import GROUPS
from quadriga.commands.config_options import KEYS, UNCONFIGURED, read_config
from quadriga.commands.parser import build_parser, main
from quadriga.shared.config.load import load

EACH = ("--yokes", "none", "--mode", "realtime", "--set", "team.plant_per_robot=true")
BRIDGED = ("--set", "team.plant=robots", "--set", "team.plant_per_robot=true")


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(arguments)
    out, err = capsys.readouterr()
    return status, out, err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["walk", "--robots", "11"], "team.robots: got 11, expected an integer in [1, 10]"),
        (["walk", "--terrain", "boxs"], "did you mean 'boxes'?"),
        (["walk", "--push", "r9:1:1:1:1"], "world.push: got a push on 'r9'"),
        (["walk", "--push", "r1:nonsense"], "world.push"),
        (["walk", "--vx", "9"], "reference.vx: got 9.0"),
        (
            ["walk", "--set", "world.motor_strength=r9:calf:0"],
            "world.motor_strength: got robot 'r9'",
        ),
        (["walk", "--set", "reference.trace=./no.csv"], "reference.trace no.csv: got No such file"),
        (["sim", "--set", "world.sed=1"], "did you mean 'world.seed'?"),
        (["sim", "--set", "nonsense"], "expected section.key=value"),
        (["sim", "--config", "/nowhere/team.toml"], "/nowhere/team.toml: got No such file"),
        (["sim", "--hung"], "--hung: got no --as, expected --as with a kind of robot"),
        (
            ["sim", "--robot", "r1"],
            "--robot: got 'r1', expected nothing (team.plant_per_robot is false)",
        ),
        (
            ["sim", *EACH],
            "--robot: got '', expected one of r1, r2, r3 (team.plant_per_robot is true)",
        ),
        (
            ["sim", "--set", "team.plant=mujoko"],
            "team.plant: got 'mujoko', expected one of mujoco, robots (did you mean 'mujoco'?)",
        ),
        (["walk", "--set", "team.plant=mujoko"], "team.plant: got 'mujoko'"),
        (["walk", "--controller", "python no.py"], "team.agent_command: got no file 'no.py'"),
        (
            ["walk", "--controller", "wlak", "--planner", "deepc"],
            "planner.kind: got 'deepc' with team.agent_command 'wlak', expected 'none'",
        ),
        (["agent", "--robot", "r1", "--controller", "wlak"], "team.agent_command: got 'wlak': No "),
        (["agent", "--robot", "r4"], "--robot: got 'r4', expected one of r1, r2, r3"),
        (
            ["agent", "--robot", "r1", "--connect", "tcp/x:1", "--endpoint", "tcp/y:1"],
            "--connect: got bus.endpoint beside it, expected one of the two",
        ),
        (["agent", "--robot", "r1", "--predictor", "/nowhere/p.npz"], "/nowhere/p.npz"),
        (
            ["agent", "--robot", "r1", "--wait", "0.1", "--predictor", "/nowhere/p.npz"],
            "predictor /nowhere/p.npz: got no such file after 0.1 s",
        ),
        (
            ["record", "--report", "-o", "walk.mcap"],
            "--output: got walk.mcap, expected DIR/run.mcap",
        ),
        (["report", "/nowhere"], "/nowhere/run.mcap: got No such file"),
        (
            ["bridge", "--robot", "r1", "--restore", "normal", "--mode", "realtime", *BRIDGED],
            "--restore: got no --armed, expected --armed with it",
        ),
        (
            [
                "bridge",
                "--robot",
                "r1",
                "--restore",
                "normal",
                "--armed",
                "--mode",
                "realtime",
                *BRIDGED,
            ],
            "--restore: got a team of Unitree A1, expected of Go2",
        ),
        (["router", "--listen", "pigeon/roof"], "bus.endpoint 'pigeon/roof' of router"),
        (["operate", "--endpoint", "pigeon/roof"], "bus.endpoint 'pigeon/roof'"),
        (["record", "-o", "/proc/run.mcap"], "/proc/run.mcap"),
        (["record", "-o", "/"], "--output: got /, a folder, expected a new file"),
        (["walk", "--endpoint", "tcp/127.0.0.1:0"], "bus.endpoint: got 'tcp/127.0.0.1:0'"),
        (["router", "--listen", "tcp/[::1]:0"], "--listen: got 'tcp/[::1]:0', expected a port"),
        (["walk", "--faults", "r1/imu stuck -4"], "world.faults: got start '-4' in"),
        (["walk", "--faults", "r1/imu off 1,r1/imu off 1"], "world.faults: got r1/imu off twice"),
        (["walk", "--push", "x", "--vx", "0.1", "--push=y"], "--push: got twice, expected once"),
        (["record", "--topics", "plan", "--topics", "state"], "--topics: got twice, expected once"),
    ],
)
def test_mistakes(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["wlak"], "command: got 'wlak', expected one that there is (did you mean 'walk'?)"),
        (
            ["xyzzy"],
            "command: got 'xyzzy', expected one that there is (`quadriga --help` lists them)",
        ),
        (
            ["walk", "--robts", "3"],
            "quadriga walk: got --robts, expected an option that it has (did you mean '--robots'?)",
        ),
        (
            ["agent", "--robto=r1"],
            "quadriga agent: got --robto, expected an option that it has (did you mean '--robot'?)",
        ),
        (
            ["walk", "--qqq"],
            "quadriga walk: got --qqq, expected an option that it has "
            "(`quadriga walk --help-all` lists them)",
        ),
        (
            ["fault", "agent-kiled"],
            "fault: got 'agent-kiled', expected the name of a fault, or all "
            "(did you mean 'agent-killed'?)",
        ),
        (
            ["fault", "xyzzy"],
            "fault: got 'xyzzy', expected the name of a fault, or all "
            "(`quadriga fault --list` lists them)",
        ),
    ],
)
def test_what_was_likely_meant_is_told(
    capsys: pytest.CaptureFixture[str], words: list[str], error: str
) -> None:
    assert run(capsys, *words) == (2, "", f"quadriga: {error}\n")


@pytest.mark.parametrize("command", sorted(UNCONFIGURED))
@pytest.mark.parametrize("option", ["--robots", "--set", "--config", "--scenario", "--help-all"])
def test_who_reads_no_configuration_takes_none(
    capsys: pytest.CaptureFixture[str], command: str, option: str
) -> None:
    status, out, err = run(capsys, command, option, "2")
    assert (status, out) == (2, "")
    assert err.startswith(f"quadriga: quadriga {command}: got {option}, expected an option that it")


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (
            ["walk", "nosuch"],
            "walk: got 'nosuch', expected nothing but options "
            "(`quadriga walk --help` tells what it takes)",
        ),
        (
            ["walk", "--robots", "2", "hard-block"],
            "walk: got 'hard-block', expected nothing but options "
            "(did you mean '--scenario hard-blocks'?)",
        ),
        (
            ["walk", "robots", "2"],
            "walk: got 'robots', expected nothing but options (did you mean '--robots'?)",
        ),
        (
            ["info", "run.mcap", "other.mcap"],
            "info: got 'other.mcap', expected nothing but options and FILE "
            "(`quadriga info --help` tells what it takes)",
        ),
        (
            ["walk", "moonwalk"],
            "walk: got 'moonwalk', expected nothing but options "
            "(`quadriga walk --help` tells what it takes)",
        ),
        (["walk", "-vx"], "walk: got '-vx', expected nothing but options (did you mean '--vx'?)"),
    ],
)
def test_a_stray_word_is_named(
    capsys: pytest.CaptureFixture[str], words: list[str], error: str
) -> None:
    assert run(capsys, *words) == (2, "", f"quadriga: quadriga {error}\n")


def test_what_stands_behind_two_dashes_is_no_option(capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "info", "--", "--robts")
    missing = "quadriga: --robts: got No such file or directory, expected a recording"
    assert (status, err) == (2, f"{missing} (did the walk start?)\n")


def test_help_is_in_groups_and_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    out = capsys.readouterr().out
    titles = re.findall(r"^(\w.*):$", out, re.MULTILINE)
    assert [title for title in GROUPS if title not in titles] == []
    assert re.findall(r"^  ([a-z][a-z-]+)  ", out, re.MULTILINE) == [*build_parser().commands]
    assert max(map(len, out.splitlines())) < 110


@pytest.mark.parametrize("command", [*build_parser().commands])
def test_a_command_shows_its_own_options(capsys: pytest.CaptureFixture[str], command: str) -> None:
    """Those of the configuration are told of in a line, and shown when asked for."""
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    own = capsys.readouterr().out
    told_of = any(name in own for name in ("--help-all", "--config", "--scenario", "--set"))
    assert told_of is (command not in UNCONFIGURED)
    assert "--terrain-height" not in own
    assert "--parent" not in own
    if command in UNCONFIGURED:
        return
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help-all"])
    every = capsys.readouterr().out
    assert "--terrain-height" in every
    assert set(re.findall("--[a-z-]+", own)) - {"--set"} <= set(re.findall("--[a-z-]+", every))


@pytest.mark.parametrize("arguments", [[], ["walk", "--robots", "three"], ["agent"]])
def test_a_wrong_command_line_shows_the_usage(
    capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert "usage: quadriga" in capsys.readouterr().err


def test_the_configuration_in_force_can_be_printed_and_read_back(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    options = ["--robots", "5", "--preset", "plain", "--set", "planner.R=[1,2,3]"]
    status, out, _ = run(capsys, "config", *options)
    assert status == 0
    path = tmp_path / "team.toml"
    path.write_text(out, encoding="utf-8")
    config = load(path)
    assert (config.team.robots, config.controller.preset) == (5, "plain")
    assert config.planner.R == (1.0, 2.0, 3.0)
    assert run(capsys, "config", "--config", str(path)) == (0, out, "")


def test_options_win_over_the_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "team.toml"
    path.write_text("[world]\nseed = 3\nduration = 9.0\n", encoding="utf-8")
    _, out, _ = run(capsys, "config", "--config", str(path), "--seed", "4", "--vx", "-0.2")
    assert "seed = 4\n" in out
    assert "duration = 9.0\n" in out
    assert "vx = -0.2\n" in out


@pytest.mark.parametrize(
    "command", [["agent", "--robot", "r2"], ["bridge", "--robot", "r2"], ["sim"], ["operate"]]
)
def test_a_process_joins_through_a_router_elsewhere(command: list[str], tmp_path: Path) -> None:
    """Whatever the file says of the bus; its other keys stay."""
    file = tmp_path / "team.toml"
    file.write_text("[bus]\nmode = 'peer'\nbarrier_timeout = 7.0\n", encoding="utf-8")
    words = [*command, "--config", str(file), "--connect", "tcp/lab:7447"]
    config, _ = read_config(build_parser().parse_args(words))
    assert (config.bus.mode, config.bus.endpoint) == ("client", "tcp/lab:7447")
    assert config.bus.barrier_timeout == 7.0


def test_every_option_names_a_key() -> None:
    config = load()
    for name in KEYS.values():
        section, _, key = name.partition(".")
        assert hasattr(getattr(config, section), key)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out.startswith("quadriga")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_among_the_first_imports_ends_a_process_quietly(number: signal.Signals) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "quadriga", "sim"], stderr=subprocess.PIPE, text=True
    )
    held = 1 << (number - 1)
    status = Path(f"/proc/{process.pid}/status")
    while not int(status.read_text().partition("SigBlk:")[2].split()[0], 16) & held:
        assert process.poll() is None, "signals are never held"
    process.send_signal(number)
    _, errors = process.communicate(timeout=30.0)
    assert (process.returncode, errors) == (130, "quadriga: interrupted\n")


def test_the_interface_of_a_bridge_is_that_of_the_network() -> None:
    """Everywhere else `--interface` is what planner and low level have between them."""
    arguments = build_parser().parse_args(["bridge", "--robot", "r1", "--interface", "eth1"])
    config, _ = read_config(arguments)
    assert config.bridge.interface == "eth1"
    assert config.planner.interface == load().planner.interface
