"""Checks of each key's messages as a sequence: order, gaps and ages."""

from __future__ import annotations

from typing import Final

from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.recordings.checks.getting_up import Doubts, GettingUp
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import max_ages, periods
from quadriga.shared.members import AGENT, PLANNER
from quadriga.shared.messages import Event, Plan, Status
from quadriga.shared.recording.ticks import TickTrack
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import COMMAND, MEASUREMENT, REQUESTS, STATE, TABLE

_MAY_REPEAT: Final = frozenset(topic.name for topic in TABLE if topic.repeats)
# What is never passed over, not even in real time: agents and planners skip steps, others do not.
_WHOLE: Final = frozenset(t.name for t in TABLE if not {AGENT, PLANNER} & {*t.senders})
_EVERYONE_S: Final = (STATE, COMMAND, MEASUREMENT)
_CONTROLLER_S: Final = (STATE, COMMAND)  # of a controller of one's own
# Sent by who only hears of the time, if somebody walks at all.
_UNTIMED: Final = tuple(word.name for word in REQUESTS)
_TAIL_MS: Final = 20  # a world that was stopped may end in the middle of a sample


class Order:
    """Ticks of one key rise; those of plans by step, then exchange.

    Events are of one key, but where each robot has a plant of its own, those of different robots
    come from different processes, and only each robot's are in order.
    """

    def __init__(self, config: Config) -> None:
        """Of a recording made with this configuration."""
        self.finding = Finding("order", "messages")
        self._last: dict[str, tuple[int, int]] = {}
        self._own_plants = config.team.plant_per_robot

    def look(self, item: CheckedMessage) -> None:
        message = item.message
        place = message.serial if isinstance(message, Plan) else (message.tick, 0)
        sequence = item.key
        if isinstance(message, Event) and self._own_plants:
            sequence += f" of {message.robot}"
        last = self._last.get(sequence, (-1, 0))
        self.finding.looked += 1
        if item.topic not in _UNTIMED and (
            place < last or (place == last and item.topic not in _MAY_REPEAT)
        ):
            what = "step" if isinstance(message, Plan) else "tick"
            self.finding.add_objection(
                message.tick, item.key, f"{what} {place[0]} after {last[0]}", f"a later {what}"
            )
        self._last[sequence] = max(place, last)

    def finish(self) -> None:
        """Nothing is left to see."""


class Gaps:
    """No message is missing between the first and the last tick, and no robot's keys are.

    In real time an agent answers the newest state and passes over older ones, so there only what
    others send must be without gaps. A robot that gets up measures and plans nothing, and one that
    does not walk plans nothing.
    """

    def __init__(self, config: Config, getting_up: GettingUp, *, filtered: bool) -> None:
        self.finding = Finding("gaps", "messages expected")
        self._doubts = Doubts(self.finding, getting_up)
        self._config, self._filtered = config, filtered
        self._periods = periods(config)
        self._tracks: dict[str, tuple[str, TickTrack]] = {}
        self._robots: dict[str, str] = {}  # by key

    def look(self, item: CheckedMessage) -> None:
        row = self._tracks.get(item.key)
        if row is None:
            row = item.topic, TickTrack(self._periods[item.topic])
            self._tracks[item.key] = row
            self._robots[item.key] = item.robot
        row[1].note(item.message.tick)

    def finish(self) -> None:
        """Count what is missing."""
        lockstep = self._config.world.mode == "lockstep"
        passed_over = 0
        for key, (topic, track) in sorted(self._tracks.items()):
            self.finding.looked += track.count + track.lost
            if lockstep or topic in _WHOLE:
                for before, after in track.gaps:
                    count = (after - before - 1) // self._periods[topic]
                    self._doubts.add(
                        self._robots[key],
                        before,
                        after,
                        key,
                        f"{count} missing after tick {before}",
                        f"one every {self._periods[topic]} ms",
                        count,
                    )
            else:
                passed_over += track.lost
        self._doubts.resolve()
        if passed_over:
            self.finding.notes.append(f"{passed_over} passed over by agents in real time")
        self._compare_robots()

    def _compare_robots(self) -> None:
        team = self._config.team
        states = [self._tracks.get(STATE.key(team.name, name)) for name in robot_names(team.robots)]
        seen = [row[1] for row in states if row is not None]
        begin = min((track.first for track in seen), default=0)
        end = max((track.last for track in seen), default=0)
        if begin > 0:
            self.finding.notes.append(f"begins at tick {begin}")
        if self._filtered:
            return
        of_each = _CONTROLLER_S if team.agent_command else _EVERYONE_S
        for robot in robot_names(team.robots):
            for topic in of_each:
                self._check_end(topic.key(team.name, robot), topic.name, end)

    def _check_end(self, key: str, topic: str, end: int) -> None:
        row = self._tracks.get(key)
        if row is None:
            self.finding.add_objection(-1, key, "no message at all", "messages like the others'")
        elif row[1].last < end - self._periods[topic] - _TAIL_MS:
            last = row[1].last
            self.finding.add_objection(
                last, key, f"none after tick {last}", f"some until tick {end}"
            )


class Ages:
    """Nothing is older than it may be: between two messages, and as the agents report it.

    A robot that gets up measures and plans nothing, and one that does not walk plans nothing.
    """

    def __init__(self, config: Config, getting_up: GettingUp) -> None:
        """Of a recording made with this configuration."""
        self.finding = Finding("ages", "messages")
        self._doubts = Doubts(self.finding, getting_up)
        self._limits = max_ages(config)
        self._last: dict[str, int] = {}
        self._oldest: dict[str, float] = {}

    def look(self, item: CheckedMessage) -> None:
        tick, limit = item.message.tick, self._limits[item.topic]
        self.finding.looked += 1
        age = tick - self._last.get(item.key, tick)
        if limit and age > limit:
            got = f"{age} ms since the one before"
            self._doubts.add(item.robot, tick - age, tick, item.key, got, f"{limit} ms")
        self._last[item.key] = tick
        if isinstance(item.message, Status) and item.message.mode == "walk":
            self._check_status(item, item.message)

    def _check_status(self, item: CheckedMessage, status: Status) -> None:
        for name, age in status.ages_ms.items():
            topic = name.partition(".")[0]
            if topic not in self._limits:
                continue  # the jitter of states in real time
            limit = self._limits[topic]
            self._oldest[topic] = max(age, self._oldest.get(topic, 0.0))
            if limit and age > limit:
                self.finding.add_objection(
                    status.tick, item.key, f"{name} {age:g} ms old", f"{limit} ms"
                )

    def finish(self) -> None:
        """Say how old what the agents used was at most."""
        self._doubts.resolve()
        ages = ", ".join(f"{name} {age:g} ms" for name, age in sorted(self._oldest.items()))
        if ages:
            self.finding.notes.append(f"agents' inputs at most: {ages}")
