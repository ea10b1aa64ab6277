"""The world once more, from a recorded configuration and the recorded commands."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from quadriga.by_tick import by_tick
from quadriga.difference import Difference, difference
from quadriga.traces import recorded_config
from shared.codec import decode, encode
from shared.config import Config
from shared.errors import MessageError, RecordingError
from shared.messages import Command, Event, Message
from shared.recording import Entry, Recording
from shared.topics import COMMAND, EVENT, STATE, TRUTH, topic_of
from sim_server.lockstep import ANSWERS
from sim_server.world import World

_NAMES: Final = frozenset(topic.name for topic in (STATE, COMMAND, TRUTH, EVENT))


@dataclass(frozen=True, slots=True)
class Resim:
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


def resim(recording: Recording) -> Iterator[Resim]:
    """Recompute the world tick by tick; the last value tells what came of it.

    A robot that the world had given up on at a tick, as the recorded events tell, is silent at
    that tick again, even if its late command was recorded.

    Raises:
        RecordingError: not of a lock-step world, or with commands missing from the file.
        ConfigError: its configuration is another version's.
    """
    config = recorded_config(recording)
    if config.world.mode != "lockstep":
        raise RecordingError(
            str(recording.path), "a walk in real time", "one in lock-step",
            "which command moved the motors in which tick is not recorded in real time",
        )  # fmt: skip
    world, silent = World(config), _Silent(config.team.name)
    key_of = {name: COMMAND.key(config.team.name, name) for name in world.names}
    compared, lost = 0, ""
    for tick, entries in by_tick(recording, _NAMES):
        if lost:
            if not any(_published(entry) for entry in entries):
                continue  # nothing of the world's came after
            if not recording.cut:
                raise RecordingError(
                    str(recording.path), lost, "a command of each robot at every tick",
                    "recorded by somebody who came later or left topics out, or lost under way",
                )  # fmt: skip
            yield Resim(tick - 1, compared, f"{lost}: {recording.cut}")
            return
        found = _compare(world, config, entries)
        if isinstance(found, Difference):
            yield Resim(tick, compared, difference=found)
            return
        compared += found
        silent.hear(entries)
        commands = _commands(key_of, entries, silent.robots)
        absent = [name for name in world.names if name not in {*commands, *silent.robots}]
        if absent:
            lost = f"no command of {', '.join(absent)} at tick {tick}"
        else:
            world.step(commands)
        yield Resim(tick + 1, compared)
    if not compared:
        raise RecordingError(
            str(recording.path), "nothing that a world published from tick 0 on",
            "states or sim/truth of a whole walk",
        )  # fmt: skip


def other_versions(recording: Recording, here: Mapping[str, str]) -> str:
    """Packages that had another version when recorded, for a difference they may explain."""
    try:
        then: dict[str, str] = json.loads(recording.metadata.get("versions", "{}"))
    except ValueError:
        return ""
    return ", ".join(
        f"{name} {version} (here {here.get(name, 'absent')})"
        for name, version in then.items()
        if here.get(name) != version
    )


def _published(entry: Entry) -> bool:
    return topic_of(entry.key)[0] in (STATE, TRUTH)


class _Silent:
    """The robots that the world does not wait for, as its events tell."""

    def __init__(self, team: str) -> None:
        self._key = EVENT.key(team)
        self.robots: set[str] = set()

    def hear(self, entries: Iterable[Entry]) -> None:
        for event in _valid(self._key, entries):
            if event.kind != "fault" or not event.robot:
                continue
            if event.detail.endswith(ANSWERS):
                self.robots.discard(event.robot)
            else:
                self.robots.add(event.robot)


def _valid(key: str, entries: Iterable[Entry]) -> Iterator[Event]:
    for entry in entries:
        if entry.key == key:
            try:
                yield decode(entry.payload, Event)
            except MessageError:
                continue  # of a foreign publisher: the world's own are valid


def _compare(world: World, config: Config, entries: Iterable[Entry]) -> int | Difference:
    """Number of the tick's messages that are equal to the world's, or the first that is not."""
    team, count = config.team.name, 0
    expected: dict[str, Message] = {
        STATE.key(team, name): state for name, state in world.states().items()
    }
    sent = {key: encode(message) for key, message in expected.items()}
    for key, _, _, payload in entries:
        if key == TRUTH.key(team) and key not in sent:
            expected[key] = world.truth()
            sent[key] = encode(expected[key])
        if key not in sent:
            continue
        if payload != sent[key]:
            return difference(key, world.tick, payload, expected[key])
        count += 1
    return count


def _commands(
    key_of: Mapping[str, str], entries: Iterable[Entry], silent: set[str]
) -> dict[str, Command]:
    """What each robot that was not silent commanded, the first valid one as the world took it."""
    found: dict[str, Command] = {}
    robot_of = {key: name for name, key in key_of.items() if name not in silent}
    for entry in entries:
        name = robot_of.get(entry.key)
        if name is not None and name not in found:
            try:
                found[name] = decode(entry.payload, Command)
            except MessageError:
                continue  # the world dropped it, too
    return {name: found[name] for name in key_of if name in found}
