"""A legitimate agent of the contract that merely stands: PD around the standing pose.

Run: python -m tests.runtime.standing_agent --config FILE --robot NAME [--parent PID]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from quadriga.shared.bus.discovery import join
from quadriga.shared.bus.session import HERE, POLL, READY, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.members import has_lead
from quadriga.shared.messages import Command, Event, State
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import die_with_parent, stop_on_signals
from quadriga.shared.topics import COMMAND, EVENT, STATE
from tests.a1 import q_stand


def run(config: Config, robot: str) -> None:
    """Answer the newest state until the walk is over."""
    stopped = stop_on_signals()
    team, ended = config.team.name, False
    zero, kp, kd = np.zeros(N_JOINTS), np.full(N_JOINTS, 80.0), np.full(N_JOINTS, 3.0)
    with Bus.open(config.bus, team, robot, stopped) as bus:
        bus.subscribe(STATE.key(team, robot))
        bus.subscribe(EVENT.key(team))
        put = bus.publisher(COMMAND.key(team, robot))
        join(bus, config, stopped)
        if config.world.mode == "realtime":  # or it lies down on a busy machine
            take_priority(config.runtime.priority)
        bus.declare(READY)
        while not (stopped() or ended):
            packet = bus.get(POLL)
            if packet is None:
                ended = not has_lead(bus.members_at(HERE))
                continue
            newest = None
            for key, payload in (packet, *bus.drain()):
                try:
                    if key == EVENT.key(team):
                        ended = ended or decode(payload, Event).kind == "stop"
                    else:
                        newest = decode(payload, State)
                except MessageError as error:
                    print(error, flush=True)
            if newest is not None:
                tick = newest.tick
                put(encode(Command(tick, 10**6 * tick, zero, q_stand(), zero, kp, kd)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--config", type=Path, required=True)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--parent", type=int)
    arguments = parser.parse_args()
    if arguments.parent:
        die_with_parent(arguments.parent)
    run(load(arguments.config), arguments.robot)
