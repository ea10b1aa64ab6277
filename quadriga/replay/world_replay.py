"""The world once more, from a recorded configuration and the recorded commands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

from quadriga.plant.commands import damp_joints
from quadriga.recordings.by_tick import by_tick
from quadriga.replay.difference import Difference, find_difference
from quadriga.shared import codes
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError, RecordingError
from quadriga.shared.messages import Command, Event, Message
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import ChunkEntry, M, Recording
from quadriga.shared.topics import COMMAND, EVENT, STATE, TRUTH, topic_of
from quadriga.sim_server.world.world import World

_NAMES: Final = frozenset(topic.name for topic in (STATE, COMMAND, TRUTH, EVENT))


@dataclass(frozen=True, slots=True)
class WorldComparison:
    """How far the world has been recomputed, and whether it still is the recorded one.

    Attributes:
        tick: ticks compared so far, ms.
        compared: messages found equal to the byte.
        note: why the comparison ends here although the recording goes on, or empty.
        difference: the first message that is not equal, or None.
    """

    tick: int
    compared: int
    note: str = ""
    difference: Difference | None = None


def replay_world(recording: Recording) -> Iterator[WorldComparison]:
    """Recompute the world tick by tick; the last value is the outcome.

    An emergency stop damps all again, until it is released.

    Raises:
        RecordingError: not of a lock-step world, or with commands missing from the file.
    """
    config = read_computable_config(recording)
    world, heard = World(config), _Heard()
    keys = {
        name: (STATE.key(config.team.name, name), COMMAND.key(config.team.name, name))
        for name in world.names
    }
    compared, lost = 0, ""
    for tick, entries in by_tick(recording, _NAMES):
        if lost:
            if not any(topic_of(entry.key)[0] in (STATE, TRUTH) for entry in entries):
                continue  # nothing of the world's came after
            if not recording.cut:
                raise RecordingError(
                    str(recording.path),
                    lost,
                    "a command of each robot at every tick",
                    "recorded by somebody who came later or left topics out, or lost under way",
                )
            yield WorldComparison(tick - 1, compared, f"{lost}: {recording.cut}")
            return
        result = _compare(world, config, entries)
        if isinstance(result, Difference):
            yield WorldComparison(tick, compared, difference=result)
            return
        compared += result
        heard.take(config.team.name, entries)
        for fault in heard.pop_faults():
            world.add_fault(fault)
        commands = _choose_commands(keys, entries)
        absent = [name for name in world.names if name not in commands]
        if heard.estop:
            world.step({name: damp_joints(tick) for name in world.names})
        elif absent:
            lost = f"no command of {', '.join(absent)} at tick {tick}"
        else:
            world.step(commands)
        yield WorldComparison(tick + 1, compared)
    if compared and recording.cut:
        yield WorldComparison(tick + 1, compared, recording.cut)
    if not compared:
        raise RecordingError(
            str(recording.path),
            "nothing that a world published from tick 0 on",
            "states or sim/truth of a whole walk",
        )


def read_asked_faults(recording: Recording) -> dict[int, list[str]]:
    """By tick the faults that somebody asked for while the team walked, as in `world.faults`."""
    found: dict[int, list[str]] = {}
    key = EVENT.key(recorded_config(recording).team.name)
    for _, event in _decode_valid(Event, key, recording.entries({EVENT.name})):
        if event.code == codes.FAULT_ASKED:
            found.setdefault(event.tick, []).append(event.detail)
    return found


def read_computable_config(recording: Recording) -> Config:
    """The configuration of a walk that can be computed again.

    Raises:
        RecordingError: it was not in lock-step, or not in one simulated world.
    """
    config = recorded_config(recording)
    if config.world.mode != "lockstep":
        raise RecordingError(
            str(recording.path),
            "a walk in real time",
            "one in lock-step",
            "which command moved the motors in which tick is not recorded in real time",
        )
    if not config.team.one_world:
        raise RecordingError(
            str(recording.path),
            f"team.plant {config.team.plant!r} and "
            f"team.plant_per_robot {str(config.team.plant_per_robot).lower()}",
            "a walk in one simulated world",
            "no other plant can be computed again",
        )
    return config


@dataclass(slots=True)
class _Heard:
    """What the world announced of what it was asked for.

    Attributes:
        estop: whether an emergency stop is in force.
        faults: that somebody has asked for, as in `world.faults`.
    """

    estop: bool = False
    faults: list[str] = field(default_factory=list)

    def pop_faults(self) -> list[str]:
        """Faults that somebody has asked for, once."""
        found, self.faults = self.faults, []
        return found

    def take(self, team: str, entries: Iterable[ChunkEntry]) -> None:
        """Take in the events of a tick."""
        for _, event in _decode_valid(Event, EVENT.key(team), entries):
            if event.code in (codes.ESTOPPED, codes.RESET):
                self.estop = event.code == codes.ESTOPPED
            if event.code == codes.FAULT_ASKED:
                self.faults.append(event.detail)


def _decode_valid(
    kind: type[M], key: str, entries: Iterable[ChunkEntry]
) -> Iterator[tuple[int, M]]:
    """Log time and content of a key's messages; what is none, the world dropped or never sent."""
    for entry in entries:
        if entry.key == key:
            with suppress(MessageError):
                yield entry.log_time_ns, decode(entry.payload, kind)


def _compare(world: World, config: Config, entries: Iterable[ChunkEntry]) -> int | Difference:
    """Number of the tick's messages that are equal to the world's, or the first that is not.

    Anybody may publish on the world's keys: of several messages the world's must be one.
    """
    team, count = config.team.name, 0
    recorded: dict[str, list[bytes]] = {}
    for key, _, _, payload in entries:
        recorded.setdefault(key, []).append(payload)
    expected: dict[str, Message] = {
        STATE.key(team, name): state for name, state in world.states().items()
    }
    if TRUTH.key(team) in recorded:
        expected[TRUTH.key(team)] = world.truth()
    for key, message in expected.items():
        if key in recorded and encode(message) not in recorded[key]:
            return find_difference(world.tick, key, recorded[key][0], message)
        count += key in recorded
    return count


def _choose_commands(
    keys: Mapping[str, tuple[str, str]], entries: Sequence[ChunkEntry]
) -> dict[str, Command]:
    """What each robot commanded in a tick, by robot in the team's order."""
    commands = {}
    for name, (state, command) in keys.items():
        valid = list(_decode_valid(Command, command, entries))
        if valid:
            asked = [entry.log_time_ns for entry in entries if entry.key == state]
            commands[name] = _choose_taken(valid, min(asked, default=0))
    return commands


def _choose_taken(commands: Sequence[tuple[int, Command]], asked: int) -> Command:
    """Which of a robot's commands of one tick the world took, as it refuses early and stale ones.

    The one that was recorded closest to the state it answers; links differ in speed, so that it
    may stand before it.
    """
    return min(commands, key=lambda command: abs(command[0] - asked))[1]
