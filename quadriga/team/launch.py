"""The table of processes: started together, watched, stopped in order."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections import deque
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from quadriga.shared.bus.diagnostics import processes
from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.members import LAST, LEADS, OPERATOR, RECORDER, ROUTER, SIM, Member, has_lead
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.installed import PYTHON
from quadriga.shared.runtime.scheduling import valid_priority
from quadriga.team.fork_server import Fork, ForkedProcess, expect_forks, start_forked

_ONE_THREAD: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
QUADRIGA: Final = (*PYTHON, "-m", "quadriga")
_SEVERAL: Final = 2  # processes, from which on it pays to import once for all
_LAST_WORDS: Final = 12  # lines of a failed process's log that are shown
_LEAST_DISK: Final = 4096  # bytes, of a file's first block
_LOOK: Final = 0.05  # s
_LARGEST_LOG: Final = 1 << 26  # bytes; of a longer one the first half is kept, and what comes then
_LAST_CHANCE: Final = 2.0  # s for who has not left by itself in time, before SIGKILL
_ROUTER_GRACE: Final = 5.0  # s
_EARLY: Final = 4.0  # s, by which others may leave before who drives time: it closes politely


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """One process of the team.

    Attributes:
        name: its name on the bus and of its log file.
        command: its command line; `--parent PID` is added.
        grace: how long it may take to leave once the walk is over or it is told to, s.
        rest: of that, how long it may take to bring a robot to rest first, s.
    """

    name: str
    command: tuple[str, ...]
    grace: float
    rest: float = 0.0


def process_table(
    config: Config,
    run_dir: Path,
    predictor: Path | None,
    sha256: str,
    *,
    armed: bool = False,
    view: str = "",
) -> tuple[ProcessSpec, ...]:
    """The processes of a walk, in the order in which they are started.

    Args:
        config: the team's configuration.
        run_dir: holds it as `config.toml`, and will hold the recording.
        predictor: the file that agents and planner read; None if they need none.
        sha256: the predictor's, for the recording.
        armed: whether bridges may command their robots.
        view: URL of a picture of the team, for who drives it; "": none.

    Raises:
        ConfigError: the environment asks for a priority that there is not.
    """
    valid_priority(config.runtime.priority)  # or each process would refuse it

    def build_row(member: Member) -> ProcessSpec:
        role, options = member.role, list[str]()
        if member.robot:
            options += ["--robot", member.robot]
        if role.predicts and predictor is not None:
            options += ["--predictor", str(predictor)]
        if role.name == RECORDER:
            options += ["-o", str(run_dir / "run.mcap"), "--predictor-sha256", sha256]
        if role.name == OPERATOR and view:
            options += ["--view", view]
        if role.name == SIM and armed:
            options.append("--armed")
        options += ["--config", str(run_dir / "config.toml")]
        command = _command(config, member)
        # Down from the stand, or out of a walk, and some time for the legs to sink.
        rest = 2.0 * config.bridge.stand_s if command == "bridge" and armed else 0.0
        return ProcessSpec(member.name, (*QUADRIGA, command, *options), role.grace + rest, rest)

    return tuple(map(build_row, processes(config)))


def expect_launch(config: Config) -> None:
    """Have what the team's processes need imported, beside all that is done before they start."""
    expect_forks({_command(config, member) for member in processes(config)}, _environment())


def _command(config: Config, member: Member) -> str:
    """What the command line calls a member's process."""
    bridged = member.role.name == SIM and config.team.plant == BRIDGED
    return "bridge" if bridged else member.role.command


def router_row(config: Config, run_dir: Path) -> ProcessSpec:
    """The router of a walk in client mode, which is started before all others."""
    words = ("router", "--listen", config.bus.endpoint, "--config", str(run_dir / "config.toml"))
    return ProcessSpec(ROUTER, (*QUADRIGA, *words), _ROUTER_GRACE)


class Launch:
    """Running processes. Leaving the context stops whatever still runs."""

    def __init__(self, rows: Sequence[ProcessSpec], logs: Path) -> None:
        """Start one process per row, each in a session of its own, its output in `logs`."""
        self._logs = logs
        self._running: dict[str, subprocess.Popen[bytes] | ForkedProcess] = {}
        self._rows = {row.name: row for row in rows}
        self._overdue = set[str]()
        logs.mkdir(parents=True, exist_ok=True)
        try:
            for row in rows:
                self._log_of(row).write_bytes(b"")
            self._start_forked([row for row in rows if _is_quadriga(row)])
            for row in rows:
                if row.name not in self._running:
                    self._start(row)
            self._running = {row.name: self._running[row.name] for row in rows}
        except BaseException:
            self.stop()  # nobody else knows of those that have been started
            raise

    def _start_forked(self, rows: Sequence[ProcessSpec]) -> None:
        """Start the project's own processes, if they are several, out of one, or none."""
        if len(rows) < _SEVERAL:
            return
        forks = [Fork(_words(row)[len(QUADRIGA) :], str(self._log_of(row))) for row in rows]
        children = start_forked(forks, _environment())
        self._running |= {row.name: child for row, child in zip(rows, children, strict=False)}

    def _start(self, row: ProcessSpec) -> None:
        with self._log_of(row).open("ab") as log:
            self._running[row.name] = subprocess.Popen(
                _words(row),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=_environment(),
                start_new_session=True,
            )

    def _log_of(self, row: ProcessSpec) -> Path:
        return self._logs / f"{row.name}.log"

    @property
    def pids(self) -> dict[str, int]:
        """Process id of each that still runs, by name."""
        return {name: process.pid for name, process in self._running.items()}

    @property
    def alive(self) -> set[str]:
        """Names of those that have not ended."""
        return {name for name, process in self._running.items() if process.poll() is None}

    def watch(self, look: Callable[[], bool]) -> None:
        """Wait until the plant has ended the walk, then until the others have left.

        Args:
            look: called all the time; returns whether to stop the walk now.

        Raises:
            ProcessError: a process failed, left while the walk went on, or stays after it; it
                names the process, how it ended and its last words.
        """
        first_to_leave, left_at = "", 0.0
        early = _EARLY + max(row.rest for row in self._rows.values())
        while has_lead(self._running):
            for name in self._reap():
                if name not in LEADS and not first_to_leave:
                    first_to_leave, left_at = name, monotonic()
            if first_to_leave and monotonic() - left_at > early:
                got, expected = "an end while the team walked", "to walk until the end"
                raise self._error(first_to_leave, got, expected)
            if look():
                self.stop()
                return
            sleep(_LOOK)
        for name in list(self._running):
            self._await(name)

    def _await(self, name: str) -> None:
        """Wait for a process that is about to leave by itself."""
        deadline = monotonic() + self._rows[name].grace
        while name in self._running and name not in self._reap():
            if monotonic() > deadline:
                self._overdue.add(name)
                raise self._error(name, "no end after the walk", "to leave by itself")
            sleep(_LOOK)

    def _reap(self) -> list[str]:
        """Names of those that have ended since this was asked last.

        Raises:
            ProcessError: the folder of the logs is gone, or some failed. Of several the first
                that a signal ended is named, since others may complain that it is gone, else the
                first of the table.
        """
        if not self._logs.is_dir():
            got, expected = "a folder that was deleted", "one that stays while the team walks"
            raise ProcessError(str(self._logs), got, expected)
        for name in self._running:
            bound_log(self._logs / f"{name}.log")
        polled = {name: process.poll() for name, process in self._running.items()}
        ended = {name: status for name, status in polled.items() if status is not None}
        for name in ended:
            del self._running[name]
        failed = sorted((name for name in ended if ended[name]), key=lambda name: ended[name] > 0)
        if failed:
            name, status = failed[0], ended[failed[0]]
            how = f"signal {-status}" if status < 0 else f"exit status {status}"
            raise self._error(name, how, "exit status 0")
        return list(ended)

    def _error(self, name: str, got: str, expected: str) -> ProcessError:
        last = f"last words in {self._logs / name}.log:\n{self._last_words(name)}"
        return ProcessError(f"process {name}", got, expected, last)

    def _last_words(self, name: str) -> str:
        lines = deque[str]()
        with (
            suppress(FileNotFoundError),
            (self._logs / f"{name}.log").open(encoding="utf-8", errors="replace") as log,
        ):
            lines = deque(log, maxlen=_LAST_WORDS)
        words = "".join(f"  {line}" for line in lines).rstrip()
        full = self._logs.is_dir() and shutil.disk_usage(self._logs).free < _LEAST_DISK
        return words or f"  (none{': the disk is full' if full else ''})"

    def stop(self) -> None:
        """Stop what still runs: SIGTERM, the recorder last, and SIGKILL after a grace period.

        Who has had its grace already, and is frozen perhaps, gets two seconds and what it needs to
        bring a robot to rest. The plant then tells the others that the walk is over, and the
        recorder hears it.
        """
        self._terminate([name for name in self._running if name != LAST])
        self._terminate([name for name in self._running if name == LAST])
        self._running.clear()

    def _terminate(self, names: Collection[str]) -> None:
        begun = monotonic()
        for name in names:
            self._running[name].terminate()
        for name in names:
            process, row = self._running[name], self._rows[name]
            deadline = begun + (row.rest + _LAST_CHANCE if name in self._overdue else row.grace)
            try:
                process.wait(max(deadline - monotonic(), 0.0))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _words(row: ProcessSpec) -> tuple[str, ...]:
    """Its command line; it learns who has started it."""
    return (*row.command, "--parent", str(os.getpid()))


def _is_quadriga(row: ProcessSpec) -> bool:
    return row.command[: len(QUADRIGA)] == QUADRIGA


def _environment() -> dict[str, str]:
    # Their logs are read as UTF-8, whatever the terminal has.
    return {**os.environ, **dict.fromkeys(_ONE_THREAD, "1"), "PYTHONIOENCODING": "utf-8"}


def bound_log(log: Path) -> None:
    """Cut a log that a process floods, and say so in it; processes write at its end."""
    if log.exists() and log.stat().st_size > _LARGEST_LOG:
        os.truncate(log, _LARGEST_LOG // 2)
        with log.open("ab") as file:
            file.write(b"\n(more was written here than a log may hold, and cut)\n")
