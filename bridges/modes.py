"""The states of a bridge, and which follows which."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final


class BridgeMode(StrEnum):
    """What a bridge does with its robot."""

    DRY = "dry"  # no motor is ever enabled
    LIMP = "limp"  # motors off
    STANDING_UP = "standing-up"
    STANDING = "standing"
    WALKING = "walking"  # the agent's commands, limited
    LYING_DOWN = "lying-down"
    TESTING = "testing"  # it hangs, and one joint after the other moves a little
    LETTING_GO = "letting-go"  # damped, then limp
    STOPPED = "stopped"  # damped, then motors off, until the bridge is started again


class Wish(StrEnum):
    """What the team, or a test, wants of the robot."""

    REST = "rest"
    STAND = "stand"
    WALK = "walk"
    LIE = "lie"
    TEST = "test"


_UPRIGHT: Final = (BridgeMode.STANDING_UP, BridgeMode.STANDING, BridgeMode.WALKING)
BY_WISH: Final[Mapping[tuple[BridgeMode, Wish], BridgeMode]] = MappingProxyType(
    {
        (BridgeMode.LIMP, Wish.STAND): BridgeMode.STANDING_UP,
        (BridgeMode.LIMP, Wish.TEST): BridgeMode.TESTING,
        (BridgeMode.STANDING, Wish.WALK): BridgeMode.WALKING,
        **{(mode, Wish.LIE): BridgeMode.LYING_DOWN for mode in _UPRIGHT},
        **{(BridgeMode.TESTING, wish): BridgeMode.LETTING_GO for wish in Wish},
        (BridgeMode.TESTING, Wish.TEST): BridgeMode.TESTING,
    }
)
"""The state that a wish leads to; from any other nothing changes."""

BY_ITSELF: Final[Mapping[BridgeMode, BridgeMode]] = MappingProxyType(
    {
        BridgeMode.STANDING_UP: BridgeMode.STANDING,
        BridgeMode.LYING_DOWN: BridgeMode.LETTING_GO,
        BridgeMode.TESTING: BridgeMode.LETTING_GO,
        BridgeMode.LETTING_GO: BridgeMode.LIMP,
    }
)
"""The state that follows when a motion is over."""
