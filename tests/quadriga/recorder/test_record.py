"""`quadriga record` beside a team that walks: late, in part, in parts, killed, out of room."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
import pytest
from mcap.reader import make_reader

from quadriga.commands.parser import main
from quadriga.recordings.survey import survey
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import BusConfig, Config, RecorderConfig, TeamConfig
from quadriga.shared.config.write import to_toml
from quadriga.shared.members import RECORDER, SIM
from quadriga.shared.messages import Command, Consumed, Plan, Reference
from quadriga.shared.recording.metadata import LOST
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic, sleep, wall_ns
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT, await_listener, await_recorded
from tests.shared.recording.test_reader import state


@pytest.fixture
def config() -> Config:
    bus = BusConfig(endpoint=free_endpoint(), barrier_timeout=WAIT)
    return Config(team=TeamConfig(name="band", robots=1), bus=bus)


@pytest.fixture
def world(config: Config) -> Iterator[Bus]:
    """The sim server's place on the bus; the team walks already."""
    with Bus.open(config.bus, "band", SIM) as bus:
        bus.declare(HERE)
        bus.declare(READY)
        yield bus


Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(config: Config, tmp_path: Path) -> Iterator[Start]:
    """A function that starts `quadriga record` with more options, and waits until it hears."""
    started = []

    def begin(
        world: Bus, *options: str, room: int = -1, of: Config = config, out: Path | None = None
    ) -> subprocess.Popen[str]:
        await_listener(world, "band/r1/state", there=False)  # of one before it that was killed
        file = tmp_path / "band.toml"
        file.write_text(to_toml(of), encoding="utf-8")
        out = out or tmp_path / "run.mcap"
        recorder = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "quadriga",
                "record",
                "--config",
                str(file),
                "-o",
                str(out),
                *options,
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, -1)),
        )
        started.append(recorder)
        await_listener(world, "band/r1/state")
        return recorder

    yield begin
    for recorder in started:
        if recorder.poll() is None:
            recorder.kill()
        recorder.communicate()


def ended(recorder: subprocess.Popen[str], world: Bus, to: Path, count: int) -> tuple[str, str]:
    """End the walk once `count` messages are recorded; what is said on stdout and stderr.

    Nobody announces the end, which is the last that is said.
    """
    await_recorded(to, count)
    world.close()
    out, err = recorder.communicate(timeout=WAIT)
    assert recorder.returncode == 1, err
    *said, last = err.splitlines(keepends=True)
    assert "process sim of team 'band', seen by recorder: got none any more" in last
    return out, "".join(said)


def test_joining_late_says_what_it_missed_and_counts_what_is_lost(
    start: Start, world: Bus, tmp_path: Path
) -> None:
    put = world.publisher("band/r1/state")
    put(encode(state(0)))
    recorder = start(world)
    for tick in range(4000, 5000):
        if not 4100 <= tick < 4110 and tick != 4500:
            put(encode(state(tick)))
    out, err = ended(recorder, world, tmp_path, 989)
    assert "joined late, has state since tick 4000" in err
    assert "989 messages, 11 lost" in out
    recording = Recording(tmp_path / "run.mcap")
    recording.require_whole()
    assert recording.notes[LOST] == {"band/r1/state": "11"}
    assert next(recording.entries()).tick == 4000


def test_commands_of_ticks_that_an_agent_passed_over_are_not_lost(
    config: Config, start: Start, world: Bus, tmp_path: Path
) -> None:
    """It tells so after the command that comes next; one more command did not come."""
    timed = replace(config, world=replace(config.world, mode="realtime"))
    recorder = start(world, of=timed)
    with Bus.open(config.bus, "band", "r1") as agent:
        await_listener(agent, "band/r1/command")
        commands, inputs = (agent.publisher(f"band/r1/{name}") for name in ("command", "inputs"))
        for tick in (*range(50), *range(53, 80), *range(81, 100)):
            commands(encode(Command(tick, 10**6 * tick, *np.zeros((5, 12)))))
            if tick == 53:
                inputs(encode(Consumed(53, 53 * 10**6, 0, 3, (), ())))
        out, _ = ended(recorder, world, tmp_path, 97)
    assert "97 messages, 1 lost" in out
    assert Recording(tmp_path / "run.mcap").notes[LOST] == {"band/r1/command": "1"}
    found = survey(tmp_path / "run.mcap")
    assert found.tracks["band/r1/command"].lost == 1


def test_who_hears_late_that_the_team_walks_joins_late_all_the_same(
    config: Config, start: Start, tmp_path: Path
) -> None:
    with Bus.open(config.bus, "band", SIM) as world:
        world.declare(HERE)
        recorder = start(world)
        assert world.wait_for(HERE, {RECORDER}, WAIT, lambda: False), "it believes to be awaited"
        world.declare(READY)
        world.publisher("band/r1/state")(encode(state(4000)))
        _, err = ended(recorder, world, tmp_path, 1)
    assert "joined late, has state since tick 4000" in err


def test_beside_a_team_s_own_recorder_nobody_is_doubled(
    config: Config, start: Start, tmp_path: Path
) -> None:
    with (
        Bus.open(config.bus, "band", SIM) as world,
        Bus.open(config.bus, "band", RECORDER) as other,
    ):
        other.declare(HERE)
        world.declare(HERE)
        recorder = start(world)
        world.publisher("band/r1/state")(encode(state(0)))
        await_recorded(tmp_path, 1)
        assert world.duplicates(HERE) == frozenset()
        _, err = ended(recorder, world, tmp_path, 1)
    assert err == f"recording team 'band' to {tmp_path / 'run.mcap'}\n"
    assert len(list(Recording(tmp_path / "run.mcap").entries())) == 1


def test_another_team_s_configuration_is_noticed(start: Start, world: Bus, tmp_path: Path) -> None:
    recorder = start(world)
    for robot in ("r1", "r2"):
        world.publisher(f"band/{robot}/state")(encode(state(70)))
    _, err = ended(recorder, world, tmp_path, 2)
    assert "r2 walk too, but the configuration that is stored is of r1: give" in err


def test_only_what_is_asked_for(start: Start, world: Bus, tmp_path: Path) -> None:
    recorder = start(world, "--topics", "state", "r2", "--exclude", "r3/*")
    for key in ("r1/state", "r2/state", "r2/plan", "r3/state", "r1/command", "reference"):
        world.publisher(f"band/{key}")(encode(state(0)))
    ended(recorder, world, tmp_path, 3)
    recording = Recording(tmp_path / "run.mcap")
    keys = sorted(entry.key for entry in recording.entries())
    assert keys == ["band/r1/state", "band/r2/plan", "band/r2/state"]
    assert recording.metadata["topics"] == '["state", "r2"]'


def test_parts_are_whole_small_and_together_everything(
    start: Start, world: Bus, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorder = start(world, "--max-size", "0.2")
    put, sent = world.publisher("band/r1/state"), []
    for tick in range(1200):
        sent.append(encode(state(tick)))
        put(sent[-1])
    out, _ = ended(recorder, world, tmp_path, len(sent))
    count = len(list(tmp_path.glob("*.mcap")))  # how many depends on when chunks were closed
    paths = [tmp_path / "run.mcap", *(tmp_path / f"run-{k}.mcap" for k in range(1, count))]
    assert "1,200 messages, 0 lost" in out
    assert count >= 3
    assert sorted(tmp_path.glob("*.mcap")) == sorted(paths)
    found = []
    for number, path in enumerate(paths):
        assert path.stat().st_size <= 200_000
        recording = Recording(path)
        recording.require_whole()
        assert recording.metadata["part"] == str(number)
        assert recording.notes[LOST] == {}
        found += [entry.payload for entry in recording.entries()]
    assert found == sent
    assert main(["record", "-o", str(tmp_path / "run.mcap"), "--max-size", "1"]) == 2
    assert "never overwritten" in capsys.readouterr().err


def test_kill_9_loses_a_tenth_of_a_second_at_most(start: Start, world: Bus, tmp_path: Path) -> None:
    put = world.publisher("band/r1/state")
    losses = []
    for attempt in range(12):  # a busy machine may not let the recorder run for a while
        path = tmp_path / f"{attempt}.mcap"
        recorder = start(world, out=path)
        sent: list[int] = []
        begun = monotonic()
        while monotonic() - begun < 0.8 + 0.03 * attempt:
            put(encode(state(len(sent))))
            sent.append(wall_ns())
            sleep(0.001)
        killed = wall_ns()
        recorder.kill()
        recorder.communicate()
        found = survey(path)
        assert found.error is not None
        for track in found.tracks.values():  # one, or none at all
            assert (track.first, track.lost) == (0, 0)
        last = max((track.last for track in found.tracks.values()), default=0)
        losses.append(1e-9 * (killed - sent[last]))
        if losses[-1] < 0.1:
            return
    pytest.fail(f"{losses} s were lost")


def test_what_comes_is_in_a_chunk_of_its_own_within_a_tenth_of_a_second(
    start: Start, world: Bus, tmp_path: Path
) -> None:
    """What a kill can cost is the chunk that is open: by the recorder's own clock, however busy."""
    recorder = start(world)
    put, begun, tick = world.publisher("band/r1/state"), monotonic(), 0
    while monotonic() - begun < 1.5:
        put(encode(state(tick)))
        tick += 1
        sleep(0.001)
    ended(recorder, world, tmp_path, tick)
    with (tmp_path / "run.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    spans = [1e-9 * (c.message_end_time - c.message_start_time) for c in summary.chunk_indexes]
    assert median(spans) < 0.1
    assert len(spans) > 5


def test_what_is_lost_is_known_after_a_kill(start: Start, world: Bus, tmp_path: Path) -> None:
    recorder = start(world)
    put = world.publisher("band/r1/state")
    for tick in (*range(100), *range(107, 200)):
        put(encode(state(tick)))
    await_recorded(tmp_path / "run.mcap", 193)
    recorder.kill()
    recorder.communicate()
    (track,) = survey(tmp_path / "run.mcap").tracks.values()
    assert (track.lost, track.gaps) == (7, [(99, 107)])


def test_a_full_disk_is_one_clear_error(start: Start, world: Bus, tmp_path: Path) -> None:
    recorder = start(world, room=100_000)
    put = world.publisher("band/r1/state")
    for tick in range(1000):
        put(encode(state(tick)))
        if tick == 100:
            await_recorded(tmp_path / "run.mcap", 101)
    out, err = recorder.communicate(timeout=WAIT)
    assert (recorder.returncode, out) == (2, "")
    assert err.count("\n") == 2  # that it records, and this
    assert "run.mcap: got File too large, expected room for the recording" in err
    assert survey(tmp_path / "run.mcap").tracks["band/r1/state"].count > 100


def test_a_full_file_system_is_named(start: Start, world: Bus, tmp_path: Path) -> None:
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(small)]
    if os.geteuid() or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no small file system can be mounted here")
    recorder = None
    try:
        recorder = start(world, out=small / "run.mcap")
        put = world.publisher("band/r1/state")
        for tick in range(1000):
            put(encode(state(tick)))
            if tick == 100:
                await_recorded(small / "run.mcap", 101)
        _, err = recorder.communicate(timeout=WAIT)
        assert recorder.returncode == 2
        assert "got No space left on device, expected room for the recording" in err
        assert err.count("\n") == 2  # that it records, and this
        assert survey(small / "run.mcap").tracks["band/r1/state"].count > 100
    finally:
        if recorder is not None:
            recorder.kill()
            recorder.wait()
        subprocess.run(["umount", "--lazy", str(small)], check=True)


@pytest.mark.parametrize("lost", [0, 7])
def test_at_once_waits_for_no_team(config: Config, start: Start, tmp_path: Path, lost: int) -> None:
    """Lost messages are a failure."""
    with Bus.open(config.bus, "band", SIM) as hub:  # it never says that it is there
        recorder = start(hub, "--now")
        plan = Plan(40, 40, 1, np.zeros((25, 12)), np.zeros((25, 6)), "solved", {}, 0)
        hub.publisher("band/r1/plan")(encode(plan))
        hub.publisher("band/reference")(encode(Reference(0, 0, 0.0, 0.0, 0.0, 0.26)))
        hub.publisher("band/r1/state")(encode(state(10)))
        await_recorded(tmp_path / "run.mcap", 3)
        if lost:
            recorder.send_signal(signal.SIGSTOP)
            sleep(0.5)
            recorder.send_signal(signal.SIGCONT)
        hub.publisher("band/r1/state")(encode(state(11 + lost)))
        await_recorded(tmp_path / "run.mcap", 4)
        recorder.terminate()
        out, _ = recorder.communicate(timeout=WAIT)
    assert recorder.returncode == bool(lost)
    assert f"4 messages, {lost} lost" in out
    assert len(list(Recording(tmp_path / "run.mcap").entries())) == 4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--topics", "a//b"), "--topics: got 'a//b'"),
        (("--max-size", "0.01"), "--max-size: got 0.01 MB, expected at least 0.1"),
        (("--max-duration", "-1"), "--max-duration: got -1 s"),
        (("--max-size", "inf"), "--max-size: got inf MB"),
        (("--max-duration", "nan"), "--max-duration: got nan s"),
        (("--report", "--max-size", "5", "-o", "x/run.mcap"), "--report: got a recording in parts"),
    ],
)
def test_mistakes_are_one_line(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    options: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["record", *options]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err


def test_a_team_without_recorder_is_recorded_from_the_start(
    config: Config, start: Start, tmp_path: Path
) -> None:
    alone = replace(config, recorder=RecorderConfig(enabled=False))
    with Bus.open(alone.bus, "band", SIM) as world:
        world.declare(HERE)
        recorder = start(world, of=alone)
        put = world.publisher("band/r1/state")
        for tick in range(10):
            put(encode(state(tick)))
        _, err = ended(recorder, world, tmp_path, 10)
    assert err == f"recording team 'band' to {tmp_path / 'run.mcap'}\n"
