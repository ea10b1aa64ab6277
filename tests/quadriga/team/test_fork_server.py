"""Processes that share what they import are children like any other."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team import fork_server
from quadriga.team.endpoint import free_endpoint
from quadriga.team.fork_server import Fork, ForkedProcess, ForkServer, start_forked
from quadriga.team.launch import QUADRIGA, Launch, ProcessSpec
from quadriga.workers import run_each

WAIT = 20.0  # s


def router(folder: Path, name: str) -> Fork:
    """A process that runs until it is stopped."""
    words = ("router", "--listen", free_endpoint(), "--parent", str(os.getpid()))
    return Fork(words, str(folder / f"{name}.log"))


def start(*forks: Fork) -> list[ForkedProcess]:
    return start_forked(forks, dict(os.environ))


def ready(forks: Sequence[Fork]) -> None:
    """Wait until each has said something."""
    wait_until(
        lambda: all(Path(fork.log).exists() and Path(fork.log).stat().st_size for fork in forks)
    )


@pytest.fixture
def forks(tmp_path: Path) -> list[Fork]:
    return [router(tmp_path, name) for name in ("one", "two")]


@pytest.fixture
def routers(forks: list[Fork]) -> Iterator[list[ForkedProcess]]:
    processes = start(*forks)
    yield processes
    for process in processes:
        process.kill()
        process.wait(WAIT)


def test_each_is_a_child_of_this_process_in_a_session_of_its_own(
    forks: list[Fork], routers: list[ForkedProcess]
) -> None:
    ready(forks)
    for fork, process in zip(forks, routers, strict=True):
        folder = Path("/proc", str(process.pid))
        fields = (folder / "stat").read_text().rpartition(") ")[2].split()
        assert [int(fields[n]) for n in (1, 3)] == [os.getpid(), process.pid]
        assert (folder / "comm").read_text() == "quadriga router\n"
        assert "routing at tcp/" in Path(fork.log).read_text()


def test_each_ends_as_it_is_told_to(forks: list[Fork], routers: list[ForkedProcess]) -> None:
    one, two = routers
    ready(forks)
    assert [one.poll(), two.poll()] == [None, None]
    with pytest.raises(subprocess.TimeoutExpired):
        one.wait(0.01)
    one.terminate()
    two.kill()
    assert [one.wait(WAIT), two.wait(WAIT)] == [0, -signal.SIGKILL]
    one.terminate()  # gone by now: nobody else is met
    assert one.poll() == 0


def test_a_wrong_command_has_its_own_status_and_says_why(tmp_path: Path) -> None:
    log = tmp_path / "agent.log"
    words = ("agent", "--robot", "r7", "--parent", str(os.getpid()))
    (process,) = start(Fork(words, str(log)))
    assert process.wait(WAIT) == 2
    assert "--robot: got 'r7'" in log.read_text()


def test_no_process_imports_from_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("json", "numpy", "pickle", "random", "zenoh"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('of the working directory')")
    monkeypatch.chdir(tmp_path)
    alone = subprocess.run([*QUADRIGA, "config"], capture_output=True, check=False)
    assert (alone.returncode, alone.stderr) == (0, b"")
    log = tmp_path / "config.log"
    (process,) = start(Fork(("config",), str(log)))
    assert (process.wait(WAIT), log.read_bytes()) == (0, alone.stdout)
    assert dict(run_each(os.getenv, ["PYTHONSAFEPATH"], 1)) == {"PYTHONSAFEPATH": None}


def test_nobody_begins_whose_start_is_not_known(forks: list[Fork]) -> None:
    """As when who starts them is interrupted between the forks and the word to begin."""
    go, begin = os.pipe()
    server = ForkServer([], os.environ)
    pids = server.start(forks, go)
    assert all(Path("/proc", str(pid)).exists() for pid in pids)
    os.close(begin)
    os.close(go)
    wait_until(lambda: not any(map(_runs, pids)))
    server.close()
    assert [Path(fork.log).read_text() for fork in forks] == ["", ""]


def test_the_next_team_comes_from_the_same_server(
    forks: list[Fork], routers: list[ForkedProcess]
) -> None:
    (server,) = fork_server._kept
    ready(forks)
    more = start(*forks)
    assert fork_server._kept == [server]
    assert all(process.poll() is None for process in routers)
    for process in more:
        process.kill()
        assert process.wait(WAIT) == -signal.SIGKILL


def test_another_environment_has_a_server_of_its_own(
    forks: list[Fork], monkeypatch: pytest.MonkeyPatch
) -> None:
    (first,) = start(forks[0])
    (server,) = fork_server._kept
    monkeypatch.setenv("OF_ANOTHER_TEAM", "1")
    (second,) = start(forks[1])
    assert fork_server._kept != [server]
    ready(forks)
    assert b"OF_ANOTHER_TEAM=1" in Path(f"/proc/{second.pid}/environ").read_bytes()
    for process in (first, second):
        process.kill()
        assert process.wait(WAIT) == -signal.SIGKILL


def test_a_server_that_has_been_killed_is_replaced(forks: list[Fork]) -> None:
    fork_server.expect_forks(["router"], os.environ)
    (server,) = fork_server._kept
    server._process.kill()
    server._process.wait()
    (process,) = start(forks[0])
    ready(forks[:1])
    process.kill()
    assert process.wait(WAIT) == -signal.SIGKILL


def test_a_server_does_not_outlive_whoever_keeps_it() -> None:
    code = (
        "import os; from quadriga.team import fork_server;"
        "fork_server.expect_forks(['agent'], os.environ);"
        "print(fork_server._kept[0]._process.pid, flush=True); os._exit(0)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    wait_until(lambda: not _runs(int(said.stdout)))


def wait_until(seen: Callable[[], bool]) -> None:
    deadline = monotonic() + WAIT
    while not seen():
        assert monotonic() < deadline
        sleep(0.02)


def _runs(pid: int) -> bool:
    try:
        return ") Z " not in Path("/proc", str(pid), "stat").read_text()
    except OSError:
        return False


def test_a_team_starts_without_a_fork_server_too(
    forks: list[Fork], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fork_server, "_kept", [])
    monkeypatch.setattr(fork_server, "__name__", "quadriga.no_module")
    assert start(*forks) == []
    words = [(*QUADRIGA, *fork.words[:-2]) for fork in forks]
    rows = [ProcessSpec(name, of, 5.0) for name, of in zip(("one", "two"), words, strict=True)]
    with Launch(rows, tmp_path) as running:
        ready(forks)
        assert running.alive == {"one", "two"}
        pids = list(running.pids.values())
    assert not any(map(_runs, pids))


def test_the_others_start_beside_them_in_the_order_of_the_table(
    forks: list[Fork], tmp_path: Path
) -> None:
    other = (sys.executable, "-c", "import time; time.sleep(60)")
    words = ((*QUADRIGA, *forks[0].words[:-2]), other, (*QUADRIGA, *forks[1].words[:-2]))
    names = ("one", "other", "two")
    rows = [ProcessSpec(name, of, 5.0) for name, of in zip(names, words, strict=True)]
    with Launch(rows, tmp_path) as running:
        ready(forks)
        assert list(running.pids) == list(names)
