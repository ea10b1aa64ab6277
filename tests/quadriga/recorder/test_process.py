"""The recorder as a process of its own, on a real bus."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import BusConfig, Config, TeamConfig
from quadriga.shared.config.write import config_sha256, to_toml
from quadriga.shared.members import OPERATOR, SIM
from quadriga.shared.messages import EStop
from quadriga.shared.recording.metadata import COUNTS
from quadriga.shared.recording.quota import MAX_FOREIGN_KEYS, OVERSIZED, REFUSED
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import wall_ns
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT, await_listener, await_recorded

RUN = """
import sys
import resource
import time
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from quadriga.recorder.process import run
from quadriga.shared.config.load import load
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime import clock
looks = count()
step = lambda: time.time_ns() - 3600 * 10**9 * (next(looks) > 5)  # somebody sets the wall clock
clock.time = SimpleNamespace(**vars(time) | {"time_ns": step})
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), -1))
try:
    run(load(Path(sys.argv[1])), Path(sys.argv[2]), predictor_sha256="ef" * 32)
except QuadrigaError as error:
    sys.exit(str(error))
"""


@pytest.fixture
def config() -> Config:
    bus = BusConfig(endpoint=free_endpoint(), barrier_timeout=WAIT)
    return Config(team=TeamConfig(name="band", robots=1), bus=bus)


@pytest.fixture
def others(config: Config) -> Iterator[dict[str, Bus]]:
    """The rest of a team of one, present on the bus."""
    names = (SIM, "r1", OPERATOR)
    buses = {name: Bus.open(config.bus, config.team.name, name) for name in names}
    for bus in buses.values():
        bus.declare(HERE)
    yield buses
    for bus in buses.values():
        bus.close()


def start(config: Config, folder: Path, largest_file: int = -1) -> subprocess.Popen[str]:
    (folder / "team.toml").write_text(to_toml(config))
    return subprocess.Popen(
        [
            sys.executable,
            "-c",
            RUN,
            str(folder / "team.toml"),
            str(folder / "run.mcap"),
            str(largest_file),
        ],
        stderr=subprocess.PIPE,
        text=True,
    )


def send(bus: Bus, count: int) -> list[tuple[str, bytes]]:
    """Publish on three keys, one of them foreign, one payload in seven not a message."""
    await_listener(bus, "band/r1/state")
    sent = []
    puts = {key: bus.publisher(key) for key in ("band/estop", "band/r1/state", "band/new/key")}
    for i in range(count):
        key = list(puts)[i % 3]
        payload = b"garbage" if i % 7 == 0 else encode(EStop(i, i * 1_000_000, "x" * (i % 50)))
        puts[key](payload)
        sent.append((key, payload))
    return sent


def finished(recorder: subprocess.Popen[str]) -> str:
    """Wait for the recorder's own end and return what it said."""
    _, text = recorder.communicate(timeout=WAIT)
    assert recorder.returncode == 0, text
    return text


def by_key(packets: list[tuple[str, bytes]]) -> dict[str, list[bytes]]:
    found: dict[str, list[bytes]] = {}
    for key, payload in packets:
        found.setdefault(key, []).append(payload)
    return found


def test_records_all_and_ends_with_the_sim_server(
    config: Config, others: dict[str, Bus], tmp_path: Path
) -> None:
    recorder = start(config, tmp_path)
    others[SIM].wait_for(READY, {"recorder"}, WAIT, lambda: False)
    sent = send(others["r1"], 3000)
    await_recorded(tmp_path, 2500)  # and the rest while the sim server leaves
    sent += [("band/sim/event", b"last words")]
    others[SIM].publisher("band/sim/event")(sent[-1][1])
    others[SIM].close()
    finished(recorder)
    recording = Recording(tmp_path / "run.mcap")
    entries = list(recording.entries())
    assert by_key([(e.key, e.payload) for e in entries]) == by_key(sent)
    assert recording.complete
    assert recording.metadata["team"] == "band"
    assert recording.metadata["config_sha256"] == config_sha256(config)
    assert recording.metadata["predictor_sha256"] == "ef" * 32
    assert {entry.tick for entry in entries if entry.payload == b"garbage"} == {-1}
    times = [entry.log_time_ns for entry in entries]
    assert times == sorted(times)
    assert abs(wall_ns() - times[-1]) < WAIT * 10**9


def test_a_signal_loses_nothing_sent_before_it(
    config: Config, others: dict[str, Bus], tmp_path: Path
) -> None:
    for attempt in range(2):  # a busy machine may keep a message under way for longer than QUIET
        folder = tmp_path / str(attempt)
        folder.mkdir()
        await_listener(others["r1"], "band/r1/state", there=False)
        recorder = start(config, folder)
        others[SIM].wait_for(READY, {"recorder"}, WAIT, lambda: False)
        sent = send(others["r1"], 5000)
        recorder.send_signal(signal.SIGTERM)
        finished(recorder)
        entries = list(Recording(folder / "run.mcap").entries())
        if by_key([(e.key, e.payload) for e in entries]) == by_key(sent):
            return
    pytest.fail(f"the recorder lost {len(sent) - len(entries)} messages at last")


def test_a_kill_leaves_a_readable_file(
    config: Config, others: dict[str, Bus], tmp_path: Path
) -> None:
    recorder = start(config, tmp_path)
    others[SIM].wait_for(READY, {"recorder"}, WAIT, lambda: False)
    sent = by_key(send(others["r1"], 2000))
    await_recorded(tmp_path, 2000)
    recorder.kill()
    recorder.communicate()
    recording = Recording(tmp_path / "run.mcap")
    found = by_key([(e.key, e.payload) for e in recording.entries()])
    assert not recording.complete
    assert sum(map(len, found.values())) == 2000
    assert found == sent


def test_stopped_before_the_team_is_there(config: Config, tmp_path: Path) -> None:
    recorder = start(config, tmp_path)
    while not (tmp_path / "run.mcap").exists():
        assert recorder.poll() is None
    recorder.send_signal(signal.SIGINT)
    finished(recorder)
    assert list(Recording(tmp_path / "run.mcap").entries()) == []


def test_a_team_that_does_not_come_is_one_clear_error(config: Config, tmp_path: Path) -> None:
    recorder = start(replace(config, bus=replace(config.bus, barrier_timeout=0.2)), tmp_path)
    _, text = recorder.communicate(timeout=WAIT)
    assert recorder.returncode == 1
    assert "band" in text
    assert "sim" in text
    assert "Traceback" not in text


def test_a_full_disk_is_one_clear_error(
    config: Config, others: dict[str, Bus], tmp_path: Path
) -> None:
    recorder = start(config, tmp_path, largest_file=40_000)
    others[SIM].wait_for(READY, {"recorder"}, WAIT, lambda: False)
    put = others["r1"].publisher("band/r1/state")
    for tick in range(2000):
        put(encode(EStop(tick, tick, f"{tick * 7919:090x}")))
    _, text = recorder.communicate(timeout=WAIT)
    assert recorder.returncode == 1
    assert "room for the recording" in text
    assert "Traceback" not in text
    recording = Recording(tmp_path / "run.mcap")
    assert 0 <= len(list(recording.entries())) < 2000
    assert recording.cut


def test_a_recording_is_never_overwritten(config: Config, tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"precious")
    recorder = start(config, tmp_path)
    _, text = recorder.communicate(timeout=WAIT)
    assert recorder.returncode == 1
    assert "never overwritten" in text
    assert (tmp_path / "run.mcap").read_bytes() == b"precious"


def test_what_others_send_neither_keeps_own_traffic_out_nor_fills_the_memory(
    config: Config, others: dict[str, Bus], tmp_path: Path
) -> None:
    """4,200 keys before the start, and payloads of 50 MB."""
    recorder = start(config, tmp_path)
    others[SIM].wait_for(READY, {"recorder"}, WAIT, lambda: False)
    stranger = others[OPERATOR]
    await_listener(stranger, "band/r1/state")
    for k in range(4200):
        stranger.publisher(f"band/flood/{k}")(b"")
    for _ in range(4):
        stranger.publisher("band/r1/plan")(bytes(50_000_000))
    sent = send(others["r1"], 300)
    own = by_key(sent)["band/r1/state"]
    await_recorded(tmp_path, MAX_FOREIGN_KEYS + 200)
    peak = peak_mb(recorder.pid)
    others[SIM].close()
    finished(recorder)
    recording = Recording(tmp_path / "run.mcap")
    assert by_key([(e.key, e.payload) for e in recording.entries()])["band/r1/state"] == own
    assert recording.notes[COUNTS][OVERSIZED] == "4"
    assert int(recording.notes[COUNTS][REFUSED]) >= 4200 - MAX_FOREIGN_KEYS
    assert peak < 400.0, "one payload under way, not all of them"


def peak_mb(pid: int) -> float:
    """Greatest resident memory of a process so far, MB."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1000
