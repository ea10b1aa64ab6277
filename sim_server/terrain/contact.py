"""Which geoms of the world touch each other, as MuJoCo's pairs of bit masks.

Two geoms touch if one's `contype` has a bit of the other's `conaffinity`. The ground has bit 1, to
which robots answer; loose stones touch ground, feet and each other by a second bit of their own.
"""

from __future__ import annotations

from typing import Final

# Robots collide with the terrain and with nothing else, not even with each other.
TERRAIN_CONTACT: Final = {"contype": 1, "conaffinity": 0}
ROBOT_CONTACT: Final = {"contype": 0, "conaffinity": 1}
NO_CONTACT: Final = {"contype": 0, "conaffinity": 0}
STONE_CONTACT: Final = {"contype": 3, "conaffinity": 2}
GROUND_OF_STONES: Final = {"contype": 3, "conaffinity": 0}
