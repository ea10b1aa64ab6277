"""`quadriga doctor` beside processes that are missing, frozen, or not what they should be.

With `--watch` files say who is healthy, until the walk is over.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.commands.parser import main
from quadriga.doctor import watch_team
from quadriga.shared.about import About, about_key
from quadriga.shared.bus.discovery import ProcessInfo, describe_process
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import monotonic
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import QUADRIGA, Launch
from tests.listening import WAIT, await_true
from tests.runtime.conftest import BEGUN, Make, Watcher

WAITS = """
import sys
from quadriga.shared.bus.discovery import (join)
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.load import parse_assignment, load
config = load(None, dict(map(parse_assignment, sys.argv[1:])))
with Bus.open(config.bus, "team", "r2") as bus:
    join(bus, config, lambda: False)
"""


def doctor(*options: str) -> tuple[int, dict[str, Any]]:
    """Exit status and JSON of the command, which leaves within seconds whatever it meets."""
    command = [*QUADRIGA, "doctor", "--json", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=WAIT, check=False)
    assert done.stderr == ""
    return done.returncode, json.loads(done.stdout)


def at(config: Config) -> tuple[str, ...]:
    """The options that name a team."""
    words = ("--connect", config.bus.endpoint, "--robots", str(config.team.robots))
    return (*words, "--set", "recorder.enabled=false")


def codes(report: dict[str, Any]) -> dict[str, list[str]]:
    """What is said of each process."""
    return {m["name"]: [d["code"] for d in m["diagnoses"]] for m in report["members"]}


@pytest.fixture
def config() -> Config:
    keys = {
        "team.robots": 3,
        "bus.mode": "client",
        "bus.endpoint": free_endpoint(),
        "recorder.enabled": False,
    }
    return load(None, keys)


@pytest.fixture
def buses(config: Config) -> Iterator[dict[str, Bus]]:
    """A router, and sessions of a team of three that wait for r2 and r3."""
    with ExitStack() as stack:
        router = stack.enter_context(Bus.route(config.bus.endpoint, "team"))
        found = {
            name: stack.enter_context(Bus.open(config.bus, "team", name))
            for name in ("sim", "r1", "operator")
        }
        yield {**found, "router": router}


def test_each_process_is_told_with_what_is_wrong_with_it(
    config: Config, buses: dict[str, Bus]
) -> None:
    ProcessInfo(buses["sim"], config)
    other = replace(config, world=replace(config.world, seed=4))
    ProcessInfo(buses["r1"], other, "ab" * 32)
    newer = encode(replace(describe_process(config, "operator"), version="9", stage="here"))
    assert decode(newer, About).wall_ns == 0, "it lives in 1970"
    buses["operator"].answer(about_key("team", "operator"), lambda: newer)
    for name in ("sim", "r1", "operator"):
        buses[name].declare(HERE)
    keys = [f"bus.endpoint={config.bus.endpoint}", "bus.mode=client", "team.robots=3"]
    with subprocess.Popen([sys.executable, "-c", WAITS, *keys]) as r2:
        try:
            assert buses["sim"].wait_for(HERE, {"r2"}, WAIT, lambda: False)
            r2.send_signal(signal.SIGSTOP)
            begun = monotonic()
            status, report = doctor(*at(config))
            took = monotonic() - begun
        finally:
            r2.kill()
    assert status == 1
    assert not report["well"]
    assert report["link"]["verdict"] == "good"
    assert codes(report) == {
        "sim": ["here"],
        "r1": ["here", "other-configuration"],
        "r2": ["not-answering"],
        "r3": ["not-started"],
        "operator": ["here", "not-seen", "other-version", "clock-off"],
    }
    said = {m["name"]: m for m in report["members"]}
    assert said["r1"]["diagnoses"][1]["text"] == (
        "another configuration: world.seed=4, sim has world.seed=0"
    )
    (process,) = said["r1"]["processes"]
    assert (process["pid"], process["stage"], process["predictor"]) == (
        os.getpid(),
        "here",
        "ab" * 32,
    )
    assert abs(process["clock_offset_s"]) <= process["clock_offset_error_s"]
    assert took < 20.0, "a frozen process holds up nobody"


def test_a_team_that_waits_for_one_and_a_doctor_that_is_none_of_it(
    make_team: Make, watcher: Watcher
) -> None:
    team = make_team()
    rows = tuple(row for row in team.rows(standing=True) if row.name != "r2")
    with Launch(rows, team.folder / "logs") as running:
        assert watcher(team).wait_for(HERE, {"sim", "r1", "operator"}, WAIT, lambda: False)
        status, report = doctor("--config", team.file)
        assert running.alive == {"sim", "r1", "operator"}
    assert status == 1
    assert codes(report) == {
        "sim": ["here"],
        "r1": ["here"],
        "r2": ["not-started"],
        "operator": ["here"],
    }
    texts = {m["name"]: m["diagnoses"][0]["text"] for m in report["members"]}
    assert texts["r1"] == "here, waits for r2"


def test_a_process_with_another_configuration_does_not_walk(make_team: Make) -> None:
    """It alone leaves, with an error that names the key."""
    team = make_team()
    file = team.folder / "other.toml"
    rows = {row.name: row for row in team.rows(standing=True)}
    other = replace(team.config, controller=replace(team.config.controller, mu=0.31))
    file.write_text(to_toml(other), encoding="utf-8")
    command = (*QUADRIGA, "operate", "--config", str(file))
    rows["operator"] = replace(rows["operator"], command=command)
    with (
        Launch(tuple(rows.values()), team.folder / "logs") as running,
        pytest.raises(ProcessError) as caught,
    ):
        running.watch(lambda: False)
    mu = f"controller.mu={team.config.controller.mu}"
    assert "process operator: got exit status 2" in str(caught.value)
    assert f"configuration: controller.mu=0.31, sim has {mu}," in str(caught.value)
    assert BEGUN not in team.log("sim")


def test_nobody_at_all(config: Config) -> None:
    status, report = doctor(*at(config))
    assert status == 1
    assert report["link"]["code"] == "link"
    assert report["link"]["text"] == f"nobody listens at {config.bus.endpoint}"
    assert {code for found in codes(report).values() for code in found} == {"no-link"}


def test_this_computer_alone(config: Config) -> None:
    _, report = doctor(*at(config), "--here")
    assert "members" not in report
    assert report["link"]["verdict"] == "note", "nobody need listen yet"
    found = {item["code"]: item["verdict"] for item in report["here"]}
    assert found.keys() >= {"realtime", "governor", "cores", "memory", "disk", "cache", "clock"}
    assert found["packages"] == "good"


def await_line(path: Path, line: str) -> None:
    """Wait until the doctor has written this down."""
    await_true(
        lambda: path.exists() and path.read_text(encoding="utf-8") == f"{line}\n",
        lambda: f"{path.name} never was {line!r}",
    )


def test_files_say_who_is_healthy_until_the_walk_is_over(
    config: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch_team, "EVERY", 0.1)
    names = ("r1", "r2", "r3", "operator", "sim")
    stop = threading.Event()
    doctor = threading.Thread(
        target=watch_team.watch_team, args=(config, tmp_path, stop.is_set), daemon=True
    )
    with ExitStack() as stack:
        stack.enter_context(Bus.route(config.bus.endpoint, "team"))
        doctor.start()
        stack.callback(stop.set)
        await_line(tmp_path / "router", "well")
        buses = {n: stack.enter_context(Bus.open(config.bus, "team", n)) for n in names}
        for bus in buses.values():
            ProcessInfo(bus, config)
            bus.declare(HERE)
        await_line(tmp_path / "r1", "not well: here, waits for the others")
        for bus in buses.values():
            bus.declare(READY)
        for name in (*names, "doctor"):
            await_line(tmp_path / name, "well")
        buses["operator"].close()
        await_line(tmp_path / "r1", "not well: does not hear operator")
        buses["sim"].close()  # who drives time
        doctor.join(WAIT)
        assert not doctor.is_alive()
    assert list(tmp_path.iterdir()) == [], "what is old says nothing"


def test_a_folder_that_is_not_there_costs_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", "--watch", str(tmp_path / "none")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "No such file or directory" in said
    assert main(["doctor", "--watch", str(tmp_path), "--json"]) == 2
