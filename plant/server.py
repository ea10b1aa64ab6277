"""The plant between its link and the bus: what lock-step and real time share."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Final

from quadriga.plant.commands import CommandBox, damp_joints
from quadriga.plant.protocol import End, Plant
from quadriga.plant.requests import find_estop
from quadriga.plant.team_time import TeamTime
from quadriga.shared import codes
from quadriga.shared.bus.liveness import find_lost_link
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import encode, truncate_text
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.errors import ConfigError
from quadriga.shared.link.connections import CLOSED
from quadriga.shared.link.packets import COMMAND
from quadriga.shared.link.plant_end import PlantEnd
from quadriga.shared.link.ticks import TickBatch
from quadriga.shared.members import plant_name
from quadriga.shared.messages import (
    Clock,
    Command,
    Event,
    LiveFault,
    Message,
    Reset,
    SafeStop,
    Status,
    format_event,
)
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import log_ns
from quadriga.shared.topics import CLOCK, EVENT, STATUS, TICKS, TICKS_MS, TRUTH

FALL_LINGER_MS: Final = 1000  # world time that is still shown after the first simulated fall
# World time in which a team that has been asked to stop slows down, comes to stand and settles.
STOP_LINGER_MS: Final = 2000
NEWER: Final = 1  # what has come of a robot: a command that counts
REFUSED: Final = 2  # one that does not
_ANSWER_MS: Final = 100  # least time between two answers to an emergency stop that is in force


class PlantServer:
    """The plant, its publishers, the commands that arrive, and when the walk is over.

    Args:
        config: the team's configuration.
        plant: its robots, or one of them.
        bus: where the agents are.
        robot: the robot that it is the plant of; "": of all.

    Attributes:
        link: to the agents.
        time: this plant's part in the team's time.
        requests: gives what people have asked for since it was called last. A bridge sees to an
            emergency stop itself.
        commands: the newest command of every robot of the plant.
    """

    def __init__(self, config: Config, plant: Plant, bus: Bus, robot: str = "") -> None:
        team, realtime = config.team.name, config.world.mode == "realtime"
        self.config, self.plant, self.bus = config, plant, bus
        self.time = TeamTime(config, robot)
        self.link = PlantEnd(config, plant.names, bus)
        self.commands = CommandBox(config.robot)
        self.requests: Callable[[], Sequence[Message]] = tuple
        self._estopped = -1  # tick of the last answer to the emergency stop in force; −1: none is
        self._stop = ""  # why somebody has asked the team to stop, and the walk to end
        # What is said may come twice; a release may end no stop that was pressed meanwhile.
        self._heard: dict[type[Message], Message] = {}
        self._batch = TickBatch(plant.names)
        self._put_ticks = bus.publisher(TICKS.key(team, plant_name(robot)), waits=not realtime)
        self._put_truth = bus.publisher(TRUTH.key(team), waits=not realtime)
        self._put_clock = bus.publisher(CLOCK.key(team), waits=not realtime)
        self._put_status = bus.publisher(STATUS.key(team, plant_name(robot)), waits=False)
        # The last one has all leave: in lock-step it comes after all else. In real time events wait
        # for nobody, and are not what gets lost when somebody is slow.
        event = EVENT.key(team)
        self._put_event = bus.publisher(event, urgent=realtime)
        self._periods = periods(config)
        self._last_tick = round(config.world.duration * 1000)
        self._fallen: set[str] = set()
        self._invalid = Counter[str]()  # by robot, as last announced
        self._published = -1  # newest tick whose states are out
        self._realtime = realtime

    def publish(self) -> None:
        """Send every robot's state of the present tick, its clock and its truth, when due.

        The truth is the whole team's: a plant of one robot among several does not know it.
        """
        plant, tick = self.plant, self.plant.tick
        # What has come over the bus before the states of this tick are out: no command of this tick
        # can be among it. Taken in later, a forged one would come before the robot's own.
        for name in self.link.heard_by_others:
            while self.receive(name, 0 if self._realtime else tick, wait=False) in (NEWER, REFUSED):
                pass
        # States come first: agents wait for them, and in real time they have half a millisecond.
        states = plant.states()
        for name, state in states.items():
            self.link.send(name, state)
        self._published, now = tick, log_ns()
        for name, state in states.items():
            self._batch.add_state(name, tick, state.row, now)
        for packet in self.bus.drain():
            self.time.take(*packet, tick)
        if self.time.drives and tick % self._periods[CLOCK.name] == 0:
            self._put_clock(encode(Clock(tick, tick * 1_000_000)))
        if self.time.alone and tick % self._periods[TRUTH.name] == 0:
            truth = plant.truth()
            if truth is not None:
                self._put_truth(encode(truth))
        if tick % TICKS_MS == 0:
            self.publish_batch()
        plant.settle()

    def publish_batch(self) -> None:
        """Tell who records or looks on what has gone over the link since the last time."""
        if (batch := self._batch.take(self.plant.tick)) is not None:
            self._put_ticks(encode(batch))

    def receive(self, robot: str, oldest: int, *, wait: bool) -> int:
        """Take in a robot's next command.

        A command of a tick whose states are not out yet, or of before tick `oldest`, is refused.

        Returns:
            `NEWER`, or `REFUSED` of one that does not count; `NOTHING` if none comes, `CLOSED` if
            the agent is gone.
        """
        link, box = self.link, self.commands
        size = link.receive(robot, wait=wait)
        if size <= CLOSED:
            return size
        got = link.received
        fault = got.parse(size)
        if fault or got.kind != COMMAND:
            box.refuse(robot, fault or f"a packet of kind {got.kind}, expected a command")
            return REFUSED
        command = Command.from_row(got.tick, got.stamp_ns, got.command.copy())
        if not box.take(robot, command, self._published, oldest):
            return REFUSED
        self._batch.add_command(robot, got.tick, command.row, log_ns())
        return NEWER

    def check_link(self) -> None:
        """End this plant's walk if its link to the router is gone: nobody hears it any more."""
        loss = find_lost_link(self.bus, self.config)
        if loss is not None and self.time.end is None:
            self.time.end = End(*loss)

    def end_without(self, robots: Collection[str], why: str) -> None:
        """End the walk because commands of some robots do not come any more, if there are any.

        Of other plants the one that drives time hears it, and announces it.
        """
        if not robots or self.time.end is not None:
            return
        refused = [self.commands.refused[r] for r in sorted(robots) if r in self.commands.refused]
        why += "".join(f", its last command was refused ({each})" for each in refused)
        detail = f"{', '.join(sorted(robots))} {why}"
        self.time.end = End(codes.COMMAND_LOST, detail)
        if not self.time.drives:
            self.announce(codes.COMMAND_LOST, self.plant.names[0], detail)

    def announce(self, code: str, robot: str, detail: str) -> None:
        """Publish an event of the present tick; a detail longer than a message's text is cut."""
        self._send(Event.of(self.plant.tick, code, robot, truncate_text(detail)))

    def take_event(self, event: Event) -> None:
        """Publish what has happened to the plant, and end the walk if it must."""
        if event.robot or self.time.drives:  # what concerns all is announced once
            self._send(event)
        self._note_fall(event)

    def publish_status(self, status: Status) -> None:
        """Publish the plant's report on itself, with what its robots have to say."""
        self._put_status(encode(self.plant.describe(status)))

    def step(self, commands: Mapping[str, Command]) -> End | None:
        """Advance the plant by one tick; why the walk ends, if it does."""
        self._report_invalid()
        if asked := self.requests():
            self._obey(asked)
        if self._estopped >= 0:
            commands = {name: damp_joints(self.plant.tick) for name in self.plant.names}
        for event in self.plant.step(commands):
            self.take_event(event)
        while self.time.falls:
            self._note_fall(self.time.falls.pop())
        if self.time.end is not None or not self.time.drives:
            return self.time.end
        if self.plant.tick < self._last_tick:
            return None
        self._report_invalid(at_once=True)
        fallen = [name for name in robot_names(self.config.team.robots) if name in self._fallen]
        if fallen:
            return End(codes.FALLEN, f"fall of {', '.join(fallen)}")
        if self._stop:
            return End(codes.STOPPED, self._stop)
        return End(codes.TIME_OVER, "end of world.duration")

    def _obey(self, asked: Sequence[Message]) -> None:
        """Do what people have asked for; an emergency stop outranks its release."""
        plant, tick = self.plant, self.plant.tick
        estop, robot = find_estop(asked), "" if self.time.alone else plant.names[0]
        for message in asked:
            if isinstance(message, LiveFault):
                self._inject(message.fault)
            elif message == self._heard.get(type(message)):
                continue
            elif isinstance(message, SafeStop) and self.time.drives:
                end = "; the walk ends" if message.ends else ""
                self.announce(codes.STOP_ASKED, "", f"{message.reason}{end}")
                if message.ends and not self._stop:
                    self._stop = message.reason or codes.STOPPED
                    self._last_tick = min(self._last_tick, tick + STOP_LINGER_MS)
            elif isinstance(message, Reset) and 0 <= self._estopped <= message.tick and not estop:
                self._estopped = -1
                self.announce(codes.RESET, robot, f"by {message.by}: robots may stand up")
                plant.expect_down(())
            self._heard[type(message)] = message
        if plant.is_robot or not estop:
            return
        if self._estopped < 0 or tick >= self._estopped + _ANSWER_MS:
            self._estopped = tick
            self.announce(codes.ESTOPPED, robot, f"{estop}: every joint is damped")
            plant.expect_down(plant.names)

    def _inject(self, fault: str) -> None:
        """Make a sensor or motor of one of the plant's robots faulty, or say why not."""
        robot, team = fault.partition("/")[0], robot_names(self.config.team.robots)
        # Whoever drives time answers for robots that there are not.
        if robot not in self.plant.names and (robot in team or not self.time.drives):
            return
        try:
            events = self.plant.inject(fault)
        except ConfigError as error:
            self.announce(codes.FAULT_REFUSED, "", str(error))
            return
        for event in events:
            self._send(event)

    def _note_fall(self, event: Event) -> None:
        if event.code == codes.UNSTABLE:
            self.time.end = End(codes.PLANT_FAILED, event.detail)
        if event.code in codes.DOWN:
            self._fallen.add(event.robot)
            # A robot that a bridge has stopped sinks: those yoked to it may not walk on.
            linger = FALL_LINGER_MS if event.code == codes.FALL else 0
            self._last_tick = min(self._last_tick, event.tick + linger)

    def _report_invalid(self, *, at_once: bool = False) -> None:
        """Announce invalid commands, once in a second of world time at most unless `at_once`."""
        if not at_once and self.plant.tick % 1000:
            return
        for robot, count in self.commands.invalid.items():
            if count != self._invalid[robot]:
                self._invalid[robot] = count
                detail = f"{count} commands dropped: {self.commands.errors[robot]}"
                self.announce(codes.MALFORMED, robot, detail)

    def _send(self, event: Event) -> None:
        self._put_event(encode(event))
        print(format_event(event), file=sys.stderr, flush=True)
