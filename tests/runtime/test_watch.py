"""`quadriga doctor --watch` beside a team: files say who is healthy, until the walk is over."""

from __future__ import annotations

import threading
from contextlib import ExitStack
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.doctor import watch_team
from quadriga.shared.bus.discovery import ProcessInfo
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint
from tests.runtime.conftest import WAIT

NAMES = ("r1", "r2", "operator", "sim")
CONFIG = load(
    None,
    {
        "team.robots": 2,
        "bus.mode": "client",
        "bus.endpoint": free_endpoint(),
        "recorder.enabled": False,
    },
)


def await_line(path: Path, line: str) -> None:
    """Wait until the doctor has written this down."""
    deadline = monotonic() + WAIT
    while not path.exists() or path.read_text(encoding="utf-8") != f"{line}\n":
        assert monotonic() < deadline, f"{path.name} never was {line!r}"
        sleep(0.02)


def test_files_say_who_is_healthy_until_the_walk_is_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch_team, "EVERY", 0.1)
    stop = threading.Event()
    doctor = threading.Thread(
        target=watch_team.watch_team, args=(CONFIG, tmp_path, stop.is_set), daemon=True
    )
    with ExitStack() as stack:
        stack.enter_context(Bus.route(CONFIG.bus.endpoint, "team"))
        doctor.start()
        stack.callback(stop.set)
        await_line(tmp_path / "router", "well")
        buses = {n: stack.enter_context(Bus.open(CONFIG.bus, "team", n)) for n in NAMES}
        for bus in buses.values():
            ProcessInfo(bus, CONFIG)
            bus.declare(HERE)
        await_line(tmp_path / "r1", "not well: here, waits for the others")
        for bus in buses.values():
            bus.declare(READY)
        for name in (*NAMES, "doctor"):
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
