"""Real time: a tick every millisecond of the clock, with the latest commands, aged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.plant.deadlines import PERIOD_MS, Deadlines
from quadriga.plant.late import FRESH, HOLD, grade, hold
from quadriga.plant.server import PlantServer
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.wire.messages import Command

TICK: Final = 1e-3  # s
_SLACK: Final = 3.0  # ticks that are made up for


def run_realtime(stage: PlantServer, stopped: Callable[[], bool]) -> str:
    """Step until the walk is over; the reason why it is, with what came late."""
    # A world that fell behind slows down: in ticks made up for at once nobody could answer.
    rate, motors = Rate(TICK, slack=_SLACK), _Motors(stage)
    reason = ""
    while not reason and not stopped():
        stage.publish()
        motors.deadlines.woke(rate.wait())  # meanwhile the agents answer
        for packet in stage.bus.drain():
            stage.commands.take(*packet, tick=stage.world.tick, oldest=0)
        reason = stage.step(motors.commands())
        if stage.world.tick % PERIOD_MS == 0 or reason:
            stage.tell(motors.deadlines.status(stage.world.tick, rate.overruns))
    late = (
        ", ".join(f"{name} {count}" for name, count in sorted(motors.deadlines.late.items()))
        or "none"
    )
    return f"{reason or 'signal'}; late ticks: {late}; overruns of the world: {rate.overruns}"


class _Motors:
    """The command each motor follows now; `deadlines` counts how late they were."""

    def __init__(self, stage: PlantServer) -> None:
        self._stage = stage
        self._held: dict[str, Command] = {}
        self.deadlines = Deadlines(stage.world.names)

    def commands(self) -> dict[str, Command]:
        """By robot; a damped robot is left out."""
        stage, tick = self._stage, self._stage.world.tick
        chosen = {}
        for name in stage.world.names:
            command = stage.commands.latest.get(name)
            age = tick - stage.commands.tick_of(name)
            state = grade(age, stage.config.world)
            self.deadlines.used(name, age)
            if command is not None and state == FRESH:
                chosen[name] = command
                self._held.pop(name, None)
            elif command is None or state == HOLD:
                self.deadlines.late[f"{name} held"] += 1
                if name not in self._held:
                    self._held[name] = hold(stage.world.states()[name])
                chosen[name] = self._held[name]
            else:
                self.deadlines.late[f"{name} damped"] += 1
                self._held.pop(name, None)  # where it was then is no place to go back to
        return chosen
