"""Who is where in an emulated network, and by which addresses: pure.

Each place is a network namespace with one address; `TEAM` is the machine's own. All are on the air.
Where robots are wired, each robot's place also has a cable to `TEAM`, where the simulated robots
are: states and commands take the cable, as between a robot and the computer on its back. What
robots and operator tell each other stays on the air, so the operator then has a place of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR
from quadriga.shared.robots.conventions import robot_names

TEAM: Final = "team"
NETWORKS: Final = 512  # that one machine can have at a time
_HOSTS: Final = {TEAM: 254, OPERATOR: 253}  # robots count from 1
_PORT: Final = 7447  # Zenoh's own


@dataclass(frozen=True, slots=True)
class NetworkLayout:
    """One emulated network.

    Attributes:
        number: tells it from others of this machine, 0 … `NETWORKS` - 1.
        robots: their names.
        wired: whether each robot's place has a cable to `TEAM`.
        rto_min_ms: least time after which TCP sends again on the air, as a route has it; 0: the
            system's own 200 ms.
    """

    number: int
    robots: tuple[str, ...]
    wired: bool
    rto_min_ms: int = 0

    @classmethod
    def of_team(
        cls, config: Config, number: int, *, wired: bool, rto_min_ms: int = 0
    ) -> NetworkLayout:
        """That of the robots of a configuration."""
        return cls(number % NETWORKS, robot_names(config.team.robots), wired, rto_min_ms)

    @property
    def places(self) -> tuple[str, ...]:
        """All places on the air, `TEAM` first."""
        return (TEAM, *((OPERATOR,) if self.wired else ()), *self.robots)

    @property
    def hosts(self) -> Mapping[int, str]:
        """Each place by the last byte of its address."""
        return {self._host(place): place for place in self.places}

    @property
    def subnet(self) -> str:
        """Of all addresses: RFC 2544 sets 198.18.0.0/15 aside for tests of networks."""
        return f"198.{18 + self.number // 256}.{self.number % 256}.0/24"

    def address(self, place: str) -> str:
        """The address of a place."""
        return f"{self.subnet.removesuffix('.0/24')}.{self._host(place)}"

    def air(self, place: str) -> str:
        """A place's device on the air; at most 15 characters."""
        return f"qair{self.number}" if place == TEAM else "air"

    def cable(self, robot: str) -> str:
        """The end of a robot's cable at `TEAM`; the other end is `cable`."""
        return f"qcable{self.number}{robot}"

    def place_of(self, process: str) -> str:
        """Where a process of the team is: agents with their robots."""
        return process if process in self.places else TEAM

    def endpoint(self, place: str, port: int = _PORT) -> str:
        """Where a process at a place listens; port 0: any free one."""
        return f"tcp/{self.address(place)}:{port}"

    def with_endpoints(self, config: Config) -> Config:
        """The configuration of the processes at `TEAM`: who they all find is there."""
        bus = replace(
            config.bus,
            # A router at `TEAM` would take what robots tell each other through their cables.
            mode="peer" if self.wired else config.bus.mode,
            endpoint=self.endpoint(TEAM),
            listen=self.endpoint(TEAM, 0),
            plaintext=True,  # no other machine is on this network
        )
        # Sockets reach from network to network: a world for all would be no longer apart.
        link = "auto" if config.team.plant_per_robot else "bus"
        return replace(config, bus=bus, plant=replace(config.plant, link=link))

    def _host(self, place: str) -> int:
        return _HOSTS[place] if place in _HOSTS else 1 + self.robots.index(place)
