"""The emergency stop: whoever is there hears it at once, also from a process that is armed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.codes import ESTOPPED
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import BusError
from quadriga.shared.members import SIM
from quadriga.shared.messages import EStop, Event, Status
from quadriga.shared.topics import ESTOP, EVENT, STATUS
from quadriga.team import emergency_stop
from quadriga.team.emergency_stop import stop_team, wait_and_stop
from quadriga.team.endpoint import free_endpoint

WAIT = 20.0  # s
_NONE = np.zeros(0)
ANSWERS = {
    STATUS.key("team", "r1"): Status(5, 0, "estop", "estop:dog", "kalman", {}, {}, _NONE, _NONE),
    EVENT.key("team"): Event.of(5, ESTOPPED, "", "dog: every joint is damped"),
}


@pytest.fixture
def config() -> Config:
    return load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})


@pytest.fixture
def team(config: Config) -> Iterator[dict[str, Bus]]:
    """A plant and an agent that hear emergency stops; the agent is not yet said to be there."""
    buses = {name: Bus.open(config.bus, "team", name) for name in (SIM, "r1")}
    for bus in buses.values():
        bus.subscribe(ESTOP.key("team"))
    buses[SIM].declare(HERE)
    yield buses
    for bus in buses.values():
        bus.close()


def armed(config: Config, folder: Path, *options: str) -> subprocess.Popen[str]:
    file = folder / "team.toml"
    file.write_text(to_toml(config), encoding="utf-8")
    command = [sys.executable, "-m", "quadriga", "estop", "--armed", "--config", str(file)]
    pipe = subprocess.PIPE
    return subprocess.Popen([*command, *options], stdin=pipe, stderr=pipe, text=True)


def test_enter_stops_whom_an_armed_process_has_found(
    config: Config, team: dict[str, Bus], tmp_path: Path
) -> None:
    with armed(config, tmp_path, "--reason", "dog") as process:
        assert process.stdin is not None
        assert process.stderr is not None
        while "armed: Enter stops sim; not there: r1" not in process.stderr.readline():
            assert process.poll() is None
        team["r1"].declare(HERE)
        assert "armed: Enter stops r1, sim" in process.stderr.readline()
        assert team["r1"].get(0.2) is None
        process.stdin.write("\n")
        process.stdin.flush()
        packets = [bus.get(WAIT) for bus in team.values()]
        for key, answer in ANSWERS.items():
            team[SIM].publisher(key)(encode(answer))
        assert process.wait(WAIT) == 0
        assert "stopped r1 within " in process.stderr.read()
    for packet in packets:
        assert packet is not None
        assert decode(packet[1], EStop).reason == "dog"


@pytest.mark.parametrize("silent", [*ANSWERS, ""])
def test_what_came_of_it_is_told_and_who_has_not_stopped_is_an_error(
    config: Config, team: dict[str, Bus], silent: str
) -> None:
    team["r1"].declare(HERE)
    puts = {key: team[SIM].publisher(key) for key in ANSWERS if key != silent}

    def answer() -> None:
        if team[SIM].get(WAIT) is not None:
            for key, put in puts.items():
                put(encode(ANSWERS[key]))

    thread, told = Thread(target=answer), list[str]()
    thread.start()
    try:
        if silent:
            said = "no word of r1 after .* r1: says" if "r1" in silent else "no word of plant after"
            with pytest.raises(BusError, match=said):
                stop_team(config, "dog", told.append)
        else:
            said = r"stopped r1 within \d+ ms: every joint is damped, until `quadriga reset`"
            stop_team(config, "dog", told.append)
            assert re.fullmatch(said, "|".join(told))
    finally:
        thread.join()


def test_a_keyboard_that_is_gone_stops_nobody(config: Config, team: dict[str, Bus]) -> None:
    team["r1"].declare(HERE)
    reading, writing = os.pipe()
    os.close(writing)
    said = list[str]()
    assert not wait_and_stop(config, "dog", reading, said.append)
    os.close(reading)
    assert team["r1"].get(0.2) is None
    assert not [line for line in said if line.startswith("stopped")]


def test_who_is_not_there_is_named_and_the_others_stop(
    config: Config, team: dict[str, Bus], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(emergency_stop, "SEARCH", 0.3)
    monkeypatch.setattr(emergency_stop, "_LONG", 0.1)
    told = list[str]()
    match = r"no r1 on the bus after 0.3 s.*\(sent to sim at once, no word yet of r1, plant;"
    with pytest.raises(BusError, match=match):
        stop_team(config, "dog", print, told.append)
    assert told == ["emergency stop: sent to sim; waiting for r1, at most 0.3 s"]
    assert team[SIM].get(WAIT) is not None
