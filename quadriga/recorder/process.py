"""SHELL of the recorder process: everything on the team's keys goes into one MCAP file."""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import platform
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from quadriga.recorder.parts import Parts
from quadriga.recorder.selection import Filter, Wanted, wishes
from quadriga.shared.bus.barrier import meet, members
from quadriga.shared.bus.members import PLANNER, RECORDER, SIM
from quadriga.shared.bus.zenoh_bus import HERE, READY, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.mcap_chunk import name_of, robot_of
from quadriga.shared.robot.a1 import robot_names
from quadriga.shared.runtime.clock import monotonic, sleep, wall_ns
from quadriga.shared.runtime.signals import stop_on_signals

FLUSH: Final = 0.05  # s wall between two flushes: a kill loses what has come since the last
QUIET: Final = 0.2  # s wall without a message after which nothing more is under way
DRAIN_LIMIT: Final = 5.0  # s wall, longest drain of a team that does not fall silent
_GATHER: Final = 0.004  # s wall, pause between looks at the inbox: one wake-up for many messages
_SLICE: Final = 500  # messages that are written at most before a look at the clock
_SETTLE: Final = 0.2  # s wall, in which the presence of all who are there becomes known
_LOOK: Final = 1.0  # s wall after which a late recorder says what it has
MEMBER: Final = "member"
LATE: Final = "late"
_PACKAGES: Final = (
    "quadriga", "eclipse-zenoh", "mujoco", "pin", "numpy", "daqp", "osqp", "numba", "msgpack",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Recorded:
    """What has been recorded: the files, the number of messages, and by key how many are lost."""

    paths: tuple[Path, ...]
    messages: int
    lost: Mapping[str, int]


def run(
    config: Config,
    path: Path,
    *,
    predictor_sha256: str = "",
    stopped: Callable[[], bool] | None = None,
    wanted: Wanted | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Recorded:
    """Record until SIGINT, SIGTERM or the sim server's leaving; then drain and finish the file.

    The recorder is a member that the team waits for, unless the team walks already or has one:
    then it records beside it from now on, nobody waits for it, and it says what it missed.
    A message's log time is when it was taken from the inbox, some ms after its reception.

    Args:
        config: the team's configuration, stored with the recording.
        path: the file to write; it must not exist.
        predictor_sha256: hash of the predictor the team walks with, stored as well.
        stopped: asked often whether to stop; by default a flag that the two signals raise.
        wanted: what to record; by default everything, in one file.
        say: told what a user should know at once.

    Raises:
        RecordingError: the file cannot be written.
        BusError: the bus cannot be opened, or the team did not assemble in time.
        ConfigError: a pattern cannot be that of a key.
    """
    stopped, wanted = stopped or stop_on_signals(), wanted or Wanted()
    about = metadata(config, predictor_sha256) | wishes(wanted)
    chosen = Filter(config.team.name, wanted)
    paths = [path]
    try:
        with Bus.open(config.bus, config.team.name, RECORDER, stopped) as bus:
            limits, periods_ = wanted.limits, periods(config)
            with Parts(path, about, config.recorder.chunk_kib, periods_, limits) as to:
                paths = to.paths
                bus.subscribe(chosen.expression)
                session = _Session(bus, to, chosen, config.team.robots, stopped, say)
                joined = _join(bus, config, stopped, at_once=wanted.at_once)
                if joined == MEMBER:
                    bus.declare(READY)
                if joined:
                    session.record(late=joined == LATE, seen=not wanted.at_once)
                session.drain()
            return Recorded(tuple(to.paths), to.messages, to.all_lost())
    except OSError as error:
        raise RecordingError(
            str(paths[-1]),
            error.strerror or str(error),
            "room for the recording",
            "`quadriga recover` makes a whole file of what is there",
        ) from None


def metadata(config: Config, predictor_sha256: str) -> dict[str, str]:
    """What a recording says of itself; `Recording.metadata` hands it back."""
    return {
        "team": config.team.name,
        "scenario": config.world.scenario,
        "config_json": json.dumps(asdict(config), sort_keys=True),
        "config_sha256": config_sha256(config),
        "predictor_sha256": predictor_sha256,
        "versions": json.dumps(versions()),
    }


def _join(bus: Bus, config: Config, stopped: Callable[[], bool], *, at_once: bool) -> str:
    """How this recorder takes part: `MEMBER`, `LATE`, or "" if it was stopped before.

    Raises:
        BusError: the team did not assemble in time.
    """
    if at_once:
        return LATE
    bus.wait_for(
        HERE,
        members(config),
        config.bus.barrier_timeout,
        lambda: stopped() or SIM in bus.present(HERE),
    )
    if stopped():
        return ""
    sleep(_SETTLE)
    walks, doubled = SIM in bus.present(READY), RECORDER in bus.present(HERE)
    if walks or doubled or not config.recorder.enabled:
        return LATE
    return MEMBER if meet(bus, config, stopped) else ""


class _Session:
    """The loop from the bus to the file."""

    def __init__(
        self,
        bus: Bus,
        to: Parts,
        chosen: Filter,
        robots: int,
        stopped: Callable[[], bool],
        say: Callable[[str], None],
    ) -> None:
        self._robots = robots
        self._bus, self._to, self._chosen, self._stopped = bus, to, chosen, stopped
        self._say = say
        self._flushed = self._begun = monotonic()
        self._ended = self._seen = False

    def record(self, *, late: bool, seen: bool) -> None:
        """Until the end; a late one says what it has once it knows.

        Args:
            late: nobody has waited for this recorder.
            seen: the sim server has been there; its leaving is the end.
        """
        self._seen = seen
        self._flushed = self._begun = monotonic()
        while not (self._stopped() or self._ended):
            self._take(max(0.0, self._flushed + FLUSH - monotonic()))
            if late and monotonic() - self._begun > _LOOK and self._to.messages:
                late = False
                self._tell_missed()
            sleep(_GATHER)
        if late and self._to.messages:
            self._tell_missed()

    def _tell_missed(self) -> None:
        since = self._to.since()
        if words := _missed(since):
            self._say(words)
        robots = {robot for robot in map(robot_of, since) if robot}
        if strangers := robots - {*robot_names(self._robots), PLANNER}:
            self._say(
                f"{', '.join(sorted(strangers))} walk too, but the configuration that is stored is "
                f"of {', '.join(robot_names(self._robots))}: give the team's with --config"
            )

    def drain(self) -> None:
        """What was sent before the end may still be under way when the end is noticed."""
        limit = monotonic() + DRAIN_LIMIT
        while self._take(QUIET) and monotonic() < limit:
            pass

    def _take(self, timeout: float) -> bool:
        """Write all that has arrived; False if nothing came within `timeout` seconds."""
        first = self._bus.get(timeout)
        packets = () if first is None else (first, *self._bus.drain())
        now, chosen, write = wall_ns(), self._chosen, self._to.write
        every = chosen.all
        for begin in range(0, len(packets), _SLICE):
            for key, payload in packets[begin : begin + _SLICE]:
                if every or chosen(key):
                    write(key, payload, now)
            self._tend()
        self._tend()
        return bool(packets)

    def _tend(self) -> None:
        """Flush when it is time to, and see whether the team is still there."""
        if monotonic() - self._flushed < FLUSH:
            return
        self._to.flush()
        self._flushed = monotonic()
        there = SIM in self._bus.present(HERE)
        self._ended = self._seen and not there
        self._seen = self._seen or there


def _missed(first: Mapping[str, int]) -> str:
    """Since when a recording has each topic, in words; "" if it has them from the first tick on."""
    found: dict[str, list[int]] = {}
    for key, tick in first.items():
        if tick >= 0:
            found.setdefault(name_of(key) or "others", []).append(tick)
    if min(map(min, found.values()), default=0) == 0:
        return ""
    words = []
    for name, ticks in sorted(found.items(), key=lambda item: min(item[1])):
        spread = f"{min(ticks)} to {max(ticks)}" if max(ticks) > min(ticks) else f"{min(ticks)}"
        words.append(f"{name} since tick {spread}")
    return f"joined late, has {', '.join(words)}; what was before is missing"


def versions() -> dict[str, str]:
    """Versions of what a run's figures depend on."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found
