"""Controllers that stand for 100 ms and then fail, each robot's in its own way.

Run by `team.controller`: python tests/runtime/faulty_controller.py r1=nan r2=ticks r3=silent …
"""

from __future__ import annotations

import sys
from typing import Final

import numpy as np

from quadriga.controller import State, build_command, read_task
from quadriga.shared.bus.zenoh_bus import HERE, POLL, READY, Bus
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Event
from quadriga.shared.wire.topics import COMMAND, EVENT, STATE

WELL: Final = 100  # ms
SLOW: Final = 2e-3  # s, for an answer
AHEAD: Final = 1000  # ms
STILL: Final = State(0, 0, *(np.zeros(cut.stop - cut.start) for cut in State.CUTS.values()))


def answer(state: State, way: str, q_des: list[float]) -> bytes | None:
    """The command that answers a state; None: there is none."""
    command = build_command(state, q_des=q_des, kp=80.0, kd=3.0)
    if way == "slow":
        sleep(SLOW)
    if state.tick < WELL or way == "slow":
        return encode(command)
    if way == "silent":
        return None
    if way == "ticks":
        return encode(type(command).from_row(state.tick + AHEAD, state.stamp_ns, command.row))
    return encode(type(command).from_row(state.tick, state.stamp_ns, np.full(60, np.nan)))


def main() -> None:
    """Answer until the walk is over; who this is, it does not say."""
    task, stopped = read_task(), stop_on_signals()
    robot, config, q_des = task.robot, task.config, task.config.robot.q_stand.tolist()
    way, team = dict(word.split("=") for word in sys.argv[1:])[robot], config.team.name
    with Bus.open(config.bus, team, robot, stopped) as bus:
        bus.subscribe(STATE.key(team, robot))
        bus.subscribe(EVENT.key(team))
        put = bus.publisher(COMMAND.key(team, robot))
        encode(build_command(decode(encode(STILL), State)))  # loads what reads and writes
        bus.declare(HERE)
        bus.declare(READY)
        while not stopped():
            packet = bus.get(POLL)
            for key, payload in (packet, *bus.drain()) if packet else ():
                if key == EVENT.key(team):
                    if decode(payload, Event).kind == "stop":
                        return
                elif (sent := answer(decode(payload, State), way, q_des)) is not None:
                    put(sent)


if __name__ == "__main__":
    main()
