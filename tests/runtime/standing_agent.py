"""A legitimate agent of the contract that merely stands: PD around the standing pose.

Run: python -m tests.runtime.standing_agent --config FILE --robot NAME [--parent PID]

As `team.agent_command` it is told how each robot fails after 100 ms of that:
python tests/runtime/standing_agent.py r1=slow r2=nan, or ticks, or silent.
"""

from __future__ import annotations

import argparse
import os
from contextlib import closing
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.shared.bus.discovery import join
from quadriga.shared.bus.session import READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.link.agent_end import AgentEnd
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import die_with_parent, stop_on_signals

WELL: Final = 100  # ms
SLOW: Final = 2e-3  # s, for an answer
AHEAD: Final = 1000  # ms


def answer(config: Config, tick: int, way: str) -> Command | None:
    """The command that answers the state of a tick; None: there is none."""
    zero, kp, kd = np.zeros(N_JOINTS), np.full(N_JOINTS, 80.0), np.full(N_JOINTS, 3.0)
    command = Command(tick, 10**6 * tick, zero, config.robot.q_stand, zero, kp, kd)
    if way == "slow":
        sleep(SLOW)
    if way in ("", "slow") or tick < WELL:
        return command
    if way == "silent":
        return None
    if way == "ticks":
        return Command.from_row(tick + AHEAD, 10**6 * tick, command.row)
    return Command.from_row(tick, 10**6 * tick, np.full(5 * N_JOINTS, np.nan))


def run(config: Config, robot: str, way: str) -> None:
    """Answer the newest state until the walk is over."""
    stopped = stop_on_signals()
    with (
        Bus.open(config.bus, config.team.name, robot, stopped) as bus,
        closing(AgentEnd(config, robot, bus)) as link,
    ):
        if not (join(bus, config, stopped) and link.open(stopped)):
            return
        if config.world.mode == "realtime":  # or it lies down on a busy machine
            take_priority(config.runtime.priority)
        bus.declare(READY)
        while not (stopped() or link.ended or link.closed):
            came = link.receive(wait=True)
            while came and link.receive(wait=False):
                pass
            if came and (command := answer(config, link.received.tick, way)) is not None:
                link.command.row[:] = command.row
                link.send(link.command.stamp(command.tick, command.stamp_ns))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("ways", nargs="*")
    parser.add_argument("--config", type=Path, default=os.environ.get("QUADRIGA_CONFIG"))
    parser.add_argument("--robot", default=os.environ.get("QUADRIGA_ROBOT"))
    parser.add_argument("--parent", type=int)
    given = parser.parse_args()
    if given.parent:
        die_with_parent(given.parent)
    ways = dict(word.split("=") for word in given.ways)
    run(load(Path(given.config)), given.robot, ways.get(given.robot, ""))
