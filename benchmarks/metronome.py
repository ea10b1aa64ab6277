"""A plant that does nothing but note when its ticks begin, as a process of its own.

Run by `benchmarks.clock`: python -m benchmarks.metronome CONFIG ROBOT OUT
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from quadriga.plant import process
from quadriga.plant.protocol import Plant
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.clock import sleep, wall_ns
from quadriga.shared.wire.messages import Command, Event, State, Status

_NUMBERS = 50  # of a state


class Metronome(Plant):
    """A robot that never moves. It counts as a real one, which keeps real time.

    Attributes:
        begun: by the wall clock, which all time namespaces of a machine have in common, ns.
        errors: of the team's clock as the status told them, ms.
    """

    is_robot = True

    def __init__(self, _config: Config, names: tuple[str, ...]) -> None:
        self.names, self.tick = names, 0
        self.begun: list[int] = []
        self.errors: list[float] = []

    def states(self) -> Mapping[str, State]:
        state = State.from_row(self.tick, self.tick * 1_000_000, np.zeros(_NUMBERS))
        return dict.fromkeys(self.names, state)

    def idle(self) -> None:
        sleep(1e-3)

    def step(self, commands: Mapping[str, Command]) -> tuple[Event, ...]:
        self.begun.append(wall_ns())
        self.tick += 1
        return ()

    def describe(self, status: Status) -> Status:
        self.errors.append(status.ages_ms["clock.error"])
        return status


def main(config: str, robot: str, out: str) -> None:
    """Walk, and write what was noted."""
    made: list[Metronome] = []

    def build(config: Config, names: tuple[str, ...]) -> Metronome:
        made.append(Metronome(config, names))
        return made[0]

    process.run(load(Path(config)), build, robot)
    np.savez(out, begun=np.array(made[0].begun, dtype=np.int64), errors=np.array(made[0].errors))


if __name__ == "__main__":
    main(*sys.argv[1:])
