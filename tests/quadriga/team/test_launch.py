"""Processes are started together, watched, and stopped, whatever they do."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team import launch
from quadriga.team.launch import Launch, ProcessSpec, process_table

LAST = "import time; time.sleep(60)"
STUBBORN = "import signal, time; signal.signal(15, signal.SIG_IGN); print('up'); time.sleep(60)"


def row(name: str, code: str, grace: float = 5.0) -> ProcessSpec:
    return ProcessSpec(name, (sys.executable, "-u", "-c", code), grace)


def never() -> bool:
    return False


def gone(pid: int) -> bool:
    return not os.path.exists(f"/proc/{pid}")


def await_lines(log: Path, count: int) -> None:
    deadline = monotonic() + 10.0
    while log.read_text().count("\n") < count and monotonic() < deadline:
        sleep(0.01)
    assert log.read_text().count("\n") == count


def test_a_walk_that_ends_well(tmp_path: Path) -> None:
    rows = [row("sim", "print('tick')"), row("r1", "import time; time.sleep(0.2)")]
    with Launch(rows, tmp_path / "logs") as running:
        running.watch(never)
        assert running.pids == {}
    assert (tmp_path / "logs" / "sim.log").read_text() == "tick\n"


def test_each_process_knows_its_parent_and_has_a_session_of_its_own(tmp_path: Path) -> None:
    code = "import os, sys; print(sys.argv[1:], os.getsid(0) == os.getpid())"
    with Launch([row("sim", code)], tmp_path) as running:
        running.watch(never)
    assert (tmp_path / "sim.log").read_text() == f"['--parent', '{os.getpid()}'] True\n"


@pytest.mark.parametrize("name", ["sim", "r1", "recorder"])
def test_a_crash_is_named_with_its_last_words_and_stops_the_others(
    tmp_path: Path, name: str
) -> None:
    rows = [row(other, LAST) for other in ("sim", "r1", "recorder") if other != name]
    rows.append(row(name, "raise SystemExit('the dog ate the torque')"))
    with Launch(rows, tmp_path) as running:
        pids = running.pids
        with pytest.raises(ProcessError) as caught:
            running.watch(never)
    assert f"process {name}: got exit status 1" in str(caught.value)
    assert "the dog ate the torque" in str(caught.value)
    assert all(gone(pid) for pid in pids.values())


def test_kill_9_of_one_is_named(tmp_path: Path) -> None:
    rows = [row("sim", LAST), row("r1", LAST)]
    with Launch(rows, tmp_path) as running:
        os.kill(running.pids["r1"], signal.SIGKILL)
        with pytest.raises(ProcessError, match="process r1: got signal 9"):
            running.watch(never)


def test_who_leaves_while_the_team_walks_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "_EARLY", 0.2)
    rows = [row("sim", LAST), row("r1", "pass"), row("r2", LAST)]
    match = "process r1: got an end while the team walked"
    with Launch(rows, tmp_path) as running, pytest.raises(ProcessError, match=match):
        running.watch(never)


def test_who_stays_after_the_walk_is_named(tmp_path: Path) -> None:
    rows = [row("sim", "pass"), row("r1", LAST, grace=0.3)]
    match = "process r1: got no end after the walk"
    with Launch(rows, tmp_path) as running, pytest.raises(ProcessError, match=match):
        running.watch(never)


def test_who_has_had_its_time_to_leave_does_not_get_it_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "_LAST_CHANCE", 0.1)
    world = LAST.replace("60", "1")  # s, by which the other is deaf to SIGTERM
    rows = [row("sim", world), row("r1", STUBBORN, grace=2.0)]
    with Launch(rows, tmp_path) as running:
        pids = running.pids
        with pytest.raises(ProcessError, match="process r1: got no end after the walk"):
            running.watch(never)
        begun = monotonic()
    assert monotonic() - begun < 1.5
    assert all(gone(pid) for pid in pids.values())


def test_who_has_been_started_is_stopped_if_another_cannot_be(tmp_path: Path) -> None:
    code = (
        f"import os, pathlib; pathlib.Path({str(tmp_path / 'pid')!r}).write_text(str(os.getpid()))"
    )
    rows = [row("sim", f"{code}; {LAST}"), ProcessSpec("r1", (str(tmp_path / "none"),), 5.0)]
    with pytest.raises(FileNotFoundError):
        Launch(rows, tmp_path)
    pid = tmp_path / "pid"
    assert not pid.exists() or gone(int(pid.read_text()))


def test_stopping_kills_who_does_not_obey_in_his_time(tmp_path: Path) -> None:
    with Launch([row("sim", STUBBORN, 0.5), row("recorder", LAST, 20.0)], tmp_path) as running:
        pids = running.pids
        await_lines(tmp_path / "sim.log", 1)
        begun = monotonic()
        running.watch(lambda: True)
    assert 0.5 < monotonic() - begun < 5.0
    assert all(gone(pid) for pid in pids.values())


def test_the_log_of_who_floods_it_is_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch, "_LARGEST_LOG", 1 << 20)
    code = """
import os
size = 0
while (now := os.fstat(1).st_size) >= size:
    size = now
    print("flood" * 10_000)
print("last words")
"""
    with Launch([row("sim", code)], tmp_path) as running:
        running.watch(never)
    text = (tmp_path / "sim.log").read_text()
    assert text.startswith("flood" * 10_000)
    assert "cut)\n" in text
    assert "last words\n" in text


def test_a_folder_that_is_deleted_while_the_team_walks_is_named(tmp_path: Path) -> None:
    def delete() -> bool:
        shutil.rmtree(tmp_path / "logs")
        return False

    match = r"logs: got a folder that was deleted"
    rows = [row("sim", LAST)]
    with Launch(rows, tmp_path / "logs") as running, pytest.raises(ProcessError, match=match):
        running.watch(delete)


def test_the_table_starts_everyone_once_and_stops_the_recorder_last() -> None:
    rows = process_table(load(None, {"team.robots": 2}), Path("run"), Path("fitted.npz"), "abc")
    assert [row.name for row in rows] == ["sim", "r1", "r2", "operator", "recorder"]
    assert "--predictor fitted.npz" in " ".join(rows[1].command)
    assert "--predictor-sha256 abc" in " ".join(rows[-1].command)
    assert all("--config run/config.toml" in " ".join(row.command) for row in rows)
    alone = process_table(load(None, {"recorder.enabled": False}), Path("run"), None, "")
    assert "recorder" not in [row.name for row in alone]
    assert "--predictor" not in alone[1].command


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder on a disk of its own on which nothing more can be written."""
    folder = tmp_path / "disk"
    folder.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)],
        capture_output=True,
        check=False,
    )
    if made.returncode:
        pytest.skip("disks are mounted by root alone")
    (folder / "sim.log").touch()
    with suppress(OSError), (folder / "filled").open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_process_that_could_not_say_that_the_disk_is_full_is_spoken_for(full_disk: Path) -> None:
    code = "import sys; print('the recording cannot be written'); sys.exit(2)"
    match = r"process sim: got exit status \d+, expected .*\n  \(none: the disk is full\)"
    with Launch([row("sim", code)], full_disk) as running, pytest.raises(ProcessError, match=match):
        running.watch(never)
