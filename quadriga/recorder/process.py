"""SHELL of the recorder process: everything on the team's keys goes into one MCAP file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from quadriga.recorder.parts import Parts
from quadriga.recorder.selection import KeyFilter, Selection
from quadriga.recorder.session import Session
from quadriga.recordings.metadata import build_metadata
from quadriga.shared.bus.diagnostics import members
from quadriga.shared.bus.discovery import ProcessInfo, await_members, join
from quadriga.shared.bus.liveness import loss_error
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.errors import BusError, ProcessError, RecordingError, system_reason
from quadriga.shared.members import RECORDER, has_lead
from quadriga.shared.recording.metadata import END
from quadriga.shared.recording.quota import Quota
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.scheduling import precede_ordinary, take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.topics import EVENT, TICKS

_HEARD: Final = 3.0  # s wall, in which a team that walks is heard of
_LOOK: Final = 0.02  # s wall between two looks for it
_SETTLE: Final = 0.2  # s wall, in which the presence of all who are there becomes known
MEMBER: Final = "member"
LATE: Final = "late"


@dataclass(frozen=True, slots=True)
class RecordedFiles:
    """What has been recorded.

    Attributes:
        paths: the files.
        messages: how many are in them.
        lost: by key, messages that did not come.
        refused: by reason, messages that were not stored, see `Quota`.
        error: what vanished while the team walked; None: the walk's end was announced, or the team
            walks on without this recorder.
    """

    paths: tuple[Path, ...]
    messages: int
    lost: Mapping[str, int]
    refused: Mapping[str, int]
    error: ProcessError | None = None


def run(
    config: Config,
    path: Path,
    *,
    predictor_sha256: str = "",
    stopped: Callable[[], bool] | None = None,
    selection: Selection | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> RecordedFiles:
    """Record until SIGINT, SIGTERM or the plant's leaving; then drain and finish the file.

    The recorder is a member that the team waits for, unless the team walks already or has one:
    then it records beside it from now on, nobody waits for it, and it reports what it missed.
    A message's log time is when it was taken from the inbox, some ms after its reception; of states
    and commands when the plant sent them, or took them in.

    Args:
        config: the team's configuration, stored with the recording.
        path: the file to write. It must not exist, unless the team walks: then it is what a
            recorder before this one has left, and `run.2.mcap` goes on beside `run.mcap`.
        predictor_sha256: hash of the predictor the team walks with, stored as well.
        stopped: asked often whether to stop; by default a flag that the two signals raise.
        selection: what to record; by default everything, in one file.
        say: called with what a user should know at once.

    Raises:
        RecordingError: the file cannot be written.
        BusError: the bus cannot be opened, or the team did not assemble in time or has something
            else in common.
        ConfigError: a pattern cannot be that of a key.
    """
    stopped, selection = stopped or stop_on_signals(), selection or Selection()
    keys = KeyFilter(config.team.name, selection)
    paths = [path]
    try:
        with Bus.open(config.bus, config.team.name, RECORDER, stopped) as bus:
            about = build_metadata(config, predictor_sha256) | selection.metadata()
            with _open_parts(config, path, about, selection, keys) as parts:
                paths = parts.paths
                _subscribe(bus, keys)
                session = Session(bus, parts, keys, config, stopped, say)
                me = None if selection.at_once else ProcessInfo(bus, config, predictor_sha256)
                role = _join(bus, config, stopped, me)
                _schedule(config)
                if role == MEMBER:
                    bus.declare(READY)
                if role:
                    session.record(late=role == LATE, seen=not selection.at_once)
                session.drain()
                ending = _note_end(parts, session)
            return _list_files(parts, ending)
    except OSError as error:
        raise RecordingError(
            str(paths[-1]),
            system_reason(error),
            "room for the recording",
            "`quadriga recover` makes a whole file of what is there",
        ) from None


def _open_parts(
    config: Config, path: Path, about: Mapping[str, str], selection: Selection, keys: KeyFilter
) -> Parts:
    return Parts(path, about, periods(config), selection.limits, quota=Quota(keys.own.__contains__))


def _schedule(config: Config) -> None:
    """Go before ordinary processes, but not before the motors' ones when those are in a hurry."""
    if config.world.mode == "lockstep":  # the others, who hurry always, would leave it nothing
        take_priority(config.runtime.priority)
    else:
        precede_ordinary(config.runtime.priority)


def _subscribe(bus: Bus, keys: KeyFilter) -> None:
    """Hear what is recorded, and the events, which announce the end of the walk."""
    bus.subscribe(keys.expression)
    if keys.expression != f"{bus.team}/**":  # states and commands are in batches of ticks
        bus.subscribe(TICKS.key(bus.team, "*"))
    event = EVENT.key(bus.team)
    if not keys(event):
        bus.subscribe(event)


def _list_files(parts: Parts, ending: ProcessError | None) -> RecordedFiles:
    return RecordedFiles(
        tuple(parts.paths), parts.messages, parts.count_lost(), parts.quota.refused, ending
    )


def _note_end(parts: Parts, session: Session) -> ProcessError | None:
    """Write down in the file why it ends, if nobody has announced it; likewise as an error."""
    loss = session.find_unannounced()
    if loss is None:
        return None
    tick = max(parts.last_tick(), 0)
    error = loss_error(loss, tick)
    detail, missed = f"{error.name}: {error.got}", str(session.loss_ns)
    parts.note(END, {"code": loss.code, "detail": detail, "tick": str(tick), "missed_ns": missed})
    return error


def _join(bus: Bus, config: Config, stopped: Callable[[], bool], me: ProcessInfo | None) -> str:
    """How this recorder takes part: `MEMBER`, `LATE`, or "" if it was stopped before.

    `me` is what it says of itself; None of one that waits for nobody.

    Raises:
        BusError: the team did not assemble in time, or has something else in common.
    """
    if me is None:
        return LATE
    await_members(
        bus, config, HERE, members(config), lambda: stopped() or has_lead(bus.members_at(HERE))
    )
    if stopped():
        return ""
    sleep(_SETTLE)
    walking, doubled = has_lead(bus.members_at(READY)), RECORDER in bus.members_at(HERE)
    if walking or doubled or not config.recorder.enabled:
        return LATE
    try:
        return MEMBER if join(bus, config, stopped, me) else ""
    except BusError:
        if not has_lead(bus.members_at(READY)):
            raise
        return LATE  # a busy machine has let it know late that the team walks
