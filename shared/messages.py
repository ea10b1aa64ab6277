"""Wire types: one frozen dataclass per message, shape, unit and frame stated per field.

Arrays are float64; a shape entry that is a string is a length shared by all fields of one
message that use the same letter (`N` horizon samples, `n` robots, `k` yokes).
Every message carries `tick` (1 ms of world time) and `stamp_ns` (the world's time of that tick).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from itertools import accumulate
from typing import Any, ClassVar, Final, Self, TypeVar, dataclass_transform

import numpy as np

from quadriga.shared.codes import EVENTS
from quadriga.shared.printable import printable_line
from quadriga.shared.robots.conventions import JOINT_NAMES, OUTPUTS, Array, Leg
from quadriga.shared.runtime.record import record

# Names of the entries of arrays, for readers that know nothing of this project.
XYZ: Final = ("x", "y", "z")
WXYZ: Final = ("w", "x", "y", "z")
LEGS: Final = tuple(leg.name for leg in Leg)
JOINTS: Final = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FORCES: Final = tuple(f"{leg}.{axis}" for leg in LEGS for axis in XYZ)
ONE: Final = ("",)  # a single number, called as its field is

F = TypeVar("F", bound="Flat")


def array(
    *shape: int | str, entries: tuple[str, ...], unit: str, frame: str = "-", finite: bool = True
) -> Any:
    """Declare an array field of the wire: its shape, unit and frame.

    `entries` are the names of its numbers: of one robot, yoke or sample if it is of several; () of
    a list of any length. With `finite` NaN and infinity are errors.
    """
    meta = {"shape": shape, "entries": entries, "unit": unit, "frame": frame, "finite": finite}
    return field(metadata=meta)


def plain(kind: type, doc: str) -> Any:
    """Declare a scalar, text, list or map field of the wire."""
    return field(metadata={"kind": kind, "doc": doc})


@record
class Message:
    """Base of all wire messages."""

    SCHEMA: ClassVar[int] = 1
    tick: int = plain(int, "world time of the content [ms]")
    stamp_ns: int = plain(int, "world time of the content [ns]")


class Flat(Message):
    """A message whose arrays all have fixed sizes: they are read-only views of one `row`.

    Made of arrays like any other, or with `from_row`, in the order of its fields. The row is
    float64 and not to be changed.
    """

    __slots__ = ("row",)
    CUTS: ClassVar[dict[str, slice]] = {}
    SIZE: ClassVar[int] = 0  # numbers of a row
    row: Array

    def __init__(self, tick: int, stamp_ns: int, *arrays: Array, **named: Array) -> None:
        super().__init__(tick, stamp_ns)
        parts = dict(zip(self.CUTS, arrays, strict=False)) | named
        if len(arrays) + len(named) != len(self.CUTS) or parts.keys() != self.CUTS.keys():
            raise TypeError(f"{type(self).__name__}: got {sorted(parts)}, expected {[*self.CUTS]}")
        for name, cut in self.CUTS.items():
            if np.shape(parts[name]) != (cut.stop - cut.start,):
                got = f"{type(self).__name__}.{name}: got shape {np.shape(parts[name])}"
                raise ValueError(f"{got}, expected {(cut.stop - cut.start,)}")
        self.row = np.concatenate([parts[name] for name in self.CUTS], dtype=float)

    @classmethod
    def entries(cls) -> tuple[str, ...]:
        """Names of the numbers of a row."""
        return tuple(
            f"{item.name}.{entry}"
            for item in fields(cls)
            for entry in item.metadata.get("entries", ())
        )

    @classmethod
    def from_row(cls, tick: int, stamp_ns: int, row: Array) -> Self:
        """The message of a row, which is kept, not copied."""
        made = cls.__new__(cls)
        Message.__init__(made, tick, stamp_ns)
        made.row = row
        return made


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def flat_record(cls: type[F]) -> type[F]:
    """A record that is `Flat`."""
    made: Any = dataclass(init=False, eq=False)(cls)
    made.CUTS = cuts_of(
        {f.name: f.metadata["shape"][0] for f in fields(made) if "shape" in f.metadata}
    )
    made.SIZE = max(cut.stop for cut in made.CUTS.values())
    for name, cut in made.CUTS.items():
        setattr(made, name, property(partial(_view, cut)))
    return made  # type: ignore[no-any-return]


def cuts_of(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Where arrays of these sizes are in a row, one behind the other."""
    stops = accumulate(sizes.values())
    return {
        name: slice(stop - size, stop)
        for (name, size), stop in zip(sizes.items(), stops, strict=True)
    }


def _view(cut: slice, message: Flat) -> Array:
    view = message.row[cut]
    view.setflags(write=False)
    return view


@flat_record
class State(Flat):
    """What one real robot measures at `tick`; nothing else may enter here."""

    __slots__ = ()
    q_joint: Array = array(12, entries=JOINTS, unit="rad", frame="joint")
    v_joint: Array = array(12, entries=JOINTS, unit="rad/s", frame="joint")
    tau_joint: Array = array(12, entries=JOINTS, unit="N·m", frame="joint")
    imu_quat_wxyz: Array = array(4, entries=WXYZ, unit="1", frame="trunk to world")
    imu_gyro: Array = array(3, entries=XYZ, unit="rad/s", frame="trunk")
    imu_accel: Array = array(3, entries=XYZ, unit="m/s²", frame="trunk (specific force)")
    foot_force: Array = array(4, entries=LEGS, unit="counts", frame="ground normal, uncalibrated")


@flat_record
class Command(Flat):
    """Motor command; the motor applies `tau + kp (q_des − q) + kd (v_des − v)`, limited."""

    __slots__ = ()
    tau: Array = array(12, entries=JOINTS, unit="N·m", frame="joint")
    q_des: Array = array(12, entries=JOINTS, unit="rad", frame="joint")
    v_des: Array = array(12, entries=JOINTS, unit="rad/s", frame="joint")
    kp: Array = array(12, entries=JOINTS, unit="N·m/rad", frame="joint")
    kd: Array = array(12, entries=JOINTS, unit="N·m·s/rad", frame="joint")


_GATHERED: Final = ("robot", "tick", "after")  # in front of each row of `Ticks`


@record
class Ticks(Message):
    """States and commands of some ticks, as they went over a plant link, for who looks on.

    In front of each row: the robot's place in `robots`, the tick, and how long after `begun_ns` it
    was sent, or taken in.
    """

    begun_ns: int = plain(int, "when the first of them was, by the sender's system clock [ns]")

    robots: tuple[str, ...] = plain(list, "names of the robots")
    states: Array = array(
        "s",
        len(_GATHERED) + State.SIZE,
        entries=(*_GATHERED, *State.entries()),
        unit="1, ms, ns, then as in State",
        finite=False,
    )
    commands: Array = array(
        "c",
        len(_GATHERED) + Command.SIZE,
        entries=(*_GATHERED, *Command.entries()),
        unit="1, ms, ns, then as in Command",
        finite=False,
    )


@record
class Measurement(Message):
    """One 100 Hz sample: mean planned forces over the 10 ms that end at `tick`, outputs at `tick`.

    Forces are those that predictors are made for: nominal ones of the scheduled feet with what a
    plan adds; not what the whole-body controller made of them.
    """

    u: Array = array(12, entries=FORCES, unit="N", frame="yaw frame, legs FL FR RL RR")
    y: Array = array(6, entries=OUTPUTS, unit="m, m/s, m/s, rad, rad, rad/s", frame="yaw frame")
    stance: Array = array(4, entries=LEGS, unit="1 stance, 0 swing", frame="legs FL FR RL RR")


@record
class Plan(Message):
    """The planner's solution of planning step `step`: N samples of 10 ms from `tick` on."""

    step: int = plain(int, "planning step, tick / (10 · applied samples)")
    u: Array = array("N", 12, entries=FORCES, unit="N", frame="yaw frame, legs FL FR RL RR")
    y: Array = array(
        "N", 6, entries=OUTPUTS, unit="m, m/s, m/s, rad, rad, rad/s", frame="yaw frame"
    )
    status: str = plain(str, "solved, or the name of the fallback in force")
    used: Mapping[str, int] = plain(dict, "for each peer the step of the plan consumed")
    exchange: int = plain(int, "0: made with peers' plans of the step before; k: k-th answer since")

    @property
    def serial(self) -> tuple[int, int]:
        """Order of the plans of one robot: by step, then by exchange."""
        return self.step, self.exchange


@record
class Status(Message):
    """An agent's account of itself; wall-clock figures live here and nowhere else."""

    mode: str = plain(str, "stand, walk, stopping, damping or estop")
    reason: str = plain(str, "why the mode is not walk; empty while walking")
    estimator: str = plain(str, "kalman or truth")
    ages_ms: Mapping[str, float] = plain(dict, "age of each input [ms of world time]")
    counters: Mapping[str, int] = plain(dict, "events counted since the start, by name")
    planner_ms: Array = array(
        "P", entries=(), unit="ms wall clock per planner step since the last status"
    )
    tick_us: Array = array(
        "K", entries=(), unit="µs wall clock per control tick since the last status"
    )


@record
class Consumed(Message):
    """What an agent took in at the step of `tick`, all of it: sent where no rule tells it.

    In real time that is every step that took in more than the state after the last one, in
    lock-step only one at which something was owed, late or passed over (see
    `agents.inbox`). Messages are referred to as `topic:sender:serial`; the serial is
    the tick, of a plan its step and exchange: `measurement:r1:480`, `plan:r1:12.0`.
    """

    number: int = plain(int, "how many of these the agent has sent before")
    passed: int = plain(int, "ticks between the last step and this one, whose states were lost")
    taken: tuple[str, ...] = plain(list, "the messages taken in, the state of `tick` aside")
    owed: tuple[str, ...] = plain(list, "in lock-step: topic/sender of what was not waited for")


@record
class Reference(Message):
    """What the operator asks of the team; in force from `tick` on."""

    vx: float = plain(float, "forward speed in the robot's yaw frame [m/s]")
    vy: float = plain(float, "leftward speed in the robot's yaw frame [m/s]")
    wz: float = plain(float, "yaw rate [rad/s]")
    height: float = plain(float, "trunk height above the ground [m]")


@record
class EStop(Message):
    """Latched stop for everyone who hears it."""

    reason: str = plain(str, "who stopped the team and why")


@record
class SafeStop(Message):
    """The team is to slow down and stand, until the operator has it go on."""

    reason: str = plain(str, "who stopped the team and why")
    ends: bool = plain(bool, "whether the walk is over once the team stands")


@record
class Reset(Message):
    """The operator releases an emergency stop: robots get up where they are, and stand."""

    by: str = plain(str, "who releases it")


@record
class Resume(Message):
    """The operator's word to go on, to robots that stand after a loss, a stop or a reset."""


@record
class LiveFault(Message):
    """A sensor or motor is to be faulty from now on, in a simulated world that permits it."""

    fault: str = plain(str, "as in world.faults without its time: robot/component kind [seconds]")


@record
class Truth(Message):
    """The world as the simulator knows it; no agent may use it outside `--estimator truth`.

    `grf` is what acts on the feet alone; what a shank or a trunk bears is not in it.
    """

    robots: tuple[str, ...] = plain(list, "robot names, the order of the first axis")
    base_pos: Array = array("n", 3, entries=XYZ, unit="m", frame="world")
    base_quat_wxyz: Array = array("n", 4, entries=WXYZ, unit="1", frame="trunk to world")
    base_vel: Array = array("n", 3, entries=XYZ, unit="m/s", frame="world")
    base_omega: Array = array("n", 3, entries=XYZ, unit="rad/s", frame="world")
    grf: Array = array("n", 4, 3, entries=FORCES, unit="N", frame="world")
    yoke_error: Array = array("k", entries=ONE, unit="m")
    yoke_force: Array = array("k", entries=ONE, unit="N")


@record
class Clock(Message):
    """How far the team's time has come, from the plant that drives it."""


@record
class Event(Message):
    """Something happened in the world."""

    SCHEMA = 2
    kind: str = plain(str, "push, payload, terrain, bridge, fault, fall, start or stop")
    robot: str = plain(str, "the robot concerned, or empty")
    detail: str = plain(str, "free text")
    code: str = plain(str, "what happened, one of quadriga.shared.codes.EVENTS")

    @classmethod
    def of(cls, tick: int, code: str, robot: str, detail: str) -> Event:
        """The announcement of something that happened at `tick`, by its code."""
        return cls(tick, tick * 1_000_000, EVENTS[code], robot, detail, code)


_LINE: Final = re.compile(r"(\d+) ms: (\S+) (\S*) (.*)")  # of an event in a log


def format_event(event: Event) -> str:
    """The line of an event: its tick, its code, the robot concerned or nothing, and its detail."""
    return printable_line(f"{event.tick} ms: {event.code} {event.robot} {event.detail}")


def parse_events(lines: Iterable[str]) -> Iterator[Event]:
    """The events of a log; lines that are none are left out."""
    for line in lines:
        match = _LINE.fullmatch(line.rstrip("\n"))
        if match is not None and match[2] in EVENTS:
            yield Event.of(int(match[1]), match[2], match[3], match[4])
