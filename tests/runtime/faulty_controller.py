"""Controllers that stand for 100 ms and then fail, each robot's in its own way.

Run by `team.agent_command`: python tests/runtime/faulty_controller.py r1=nan r2=ticks r3=silent …
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.shared.bus.session import HERE, POLL, READY, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import Command, Event, State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.topics import COMMAND, EVENT, STATE

WELL: Final = 100  # ms
SLOW: Final = 2e-3  # s, for an answer
AHEAD: Final = 1000  # ms
STILL: Final = State(0, 0, *(np.zeros(cut.stop - cut.start) for cut in State.CUTS.values()))


def answer(state: State, way: str, q_des: Array) -> bytes | None:
    """The command that answers a state; None: there is none."""
    row = np.concatenate([np.zeros(12), q_des, np.zeros(12), np.full(12, 80.0), np.full(12, 3.0)])
    tick, stamp_ns = state.tick, state.stamp_ns
    if way == "slow":
        sleep(SLOW)
    if state.tick < WELL or way == "slow":
        return encode(Command.from_row(tick, stamp_ns, row))
    if way == "silent":
        return None
    if way == "ticks":
        return encode(Command.from_row(tick + AHEAD, stamp_ns, row))
    return encode(Command.from_row(tick, stamp_ns, np.full(60, np.nan)))


def main() -> None:
    """Answer until the walk is over; who this is, it does not say."""
    robot, stopped = os.environ["QUADRIGA_ROBOT"], stop_on_signals()
    config = load(Path(os.environ["QUADRIGA_CONFIG"]))
    way, team = dict(word.split("=") for word in sys.argv[1:])[robot], config.team.name
    q_stand = config.robot.q_stand
    with Bus.open(config.bus, team, robot, stopped) as bus:
        bus.subscribe(STATE.key(team, robot))
        bus.subscribe(EVENT.key(team))
        put = bus.publisher(COMMAND.key(team, robot))
        answer(decode(encode(STILL), State), way, q_stand)  # loads what reads and writes
        bus.declare(HERE)
        bus.declare(READY)
        while not stopped():
            packet = bus.get(POLL)
            for key, payload in (packet, *bus.drain()) if packet else ():
                if key == EVENT.key(team):
                    if decode(payload, Event).kind == "stop":
                        return
                elif (sent := answer(decode(payload, State), way, q_stand)) is not None:
                    put(sent)


if __name__ == "__main__":
    main()
