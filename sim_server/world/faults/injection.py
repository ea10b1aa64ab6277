"""Faults of a world's robots, applied to what is measured and to what is commanded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array, robot_names
from quadriga.shared.wire import codes
from quadriga.shared.wire.messages import Event, State
from quadriga.sim_server.world.faults.components import build_components
from quadriga.sim_server.world.faults.distortion import Distortion
from quadriga.sim_server.world.faults.fault import ComponentFault, parse_faults

_STREAM: Final = 5  # of the seed; terrain, sensors, pushes and motors draw from others


class Injection:
    """The faults of `world.faults`, and those added later; without any it costs nothing.

    Attributes:
        events: when each fault of the configuration begins and ends.

    Args:
        config: the team's configuration.
        names: of the robots that are in the world, in the order of their rows.

    Raises:
        ConfigError: `world.faults` does not parse, or names what there is not.
    """

    def __init__(self, config: Config, names: Sequence[str]) -> None:
        self._components = build_components(config.robot)
        self._team, self._names = robot_names(config.team.robots), tuple(names)
        self._seed, self._count = config.world.seed, 0
        self._sensors: dict[str, list[Distortion]] = {}
        self._motors: dict[int, list[Distortion]] = {}
        self.events = self.add(config.world.faults)

    def add(self, text: str) -> list[Event]:
        """Add faults that have not begun; when each begins and ends.

        Raises:
            ConfigError: the text does not parse, or names what there is not.
        """
        found = list[Event]()
        for fault in parse_faults(text, self._team, tuple(self._components)):
            self._add(fault)
            found.append(Event.of(fault.start, codes.FAULT_BEGINS, fault.robot, fault.detail))
            if fault.stop is not None:
                detail = f"{fault.component} sound again"
                found.append(Event.of(fault.stop, codes.FAULT_ENDS, fault.robot, detail))
        return found

    def _add(self, fault: ComponentFault) -> None:
        number, self._count = self._count, self._count + 1
        if fault.robot not in self._names:
            return
        for part, component in enumerate(self._components[fault.component]):
            chance = np.random.default_rng((self._seed, _STREAM, number, part))
            made = Distortion(fault, component, chance)
            if component.message is State:
                self._sensors.setdefault(fault.robot, []).append(made)
            else:
                self._motors.setdefault(self._names.index(fault.robot), []).append(made)

    def distort_states(self, states: Mapping[str, State]) -> dict[str, State]:
        """What faulty sensors make of the states of a tick, by robot; called once a tick."""
        distorted = dict(states)
        for name, distortions in self._sensors.items():
            state = states[name]
            row = _distort(state.row, state.tick, distortions)
            distorted[name] = State.from_row(state.tick, state.stamp_ns, row)
        return distorted

    def distort_commands(self, tick: int, rows: Sequence[Array]) -> list[Array]:
        """What faulty motors make of the rows of `Command`s of a tick; called once a tick.

        Args:
            tick: at which the motors are driven.
            rows: one for each robot of the world, (60,).
        """
        distorted = list(rows)
        for index, distortions in self._motors.items():
            distorted[index] = _distort(rows[index], tick, distortions)
        return distorted


def _distort(row: Array, tick: int, distortions: Sequence[Distortion]) -> Array:
    row = row.copy()
    for one in distortions:
        columns = one.component.columns
        row[columns] = one.distort(tick, row[columns])
    return row
