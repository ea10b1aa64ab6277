"""The kinds of robots there are, by the name they have in the configuration."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from quadriga.shared.robots.a1 import A1
from quadriga.shared.robots.go1 import GO1
from quadriga.shared.robots.go2 import GO2
from quadriga.shared.robots.spec import RobotSpec

ROBOTS: Final[Mapping[str, RobotSpec]] = MappingProxyType(
    {robot.kind: robot for robot in (A1, GO1, GO2)}
)
