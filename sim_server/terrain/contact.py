"""Which geoms of the world touch each other, as MuJoCo's pairs of bit masks.

Two geoms touch if one's `contype` has a bit of the other's `conaffinity`. The ground has bit 1, to
which robots answer; loose stones touch ground, robots and each other by a second bit of their own.
Legs and trunks touch each other by the third. MuJoCo leaves out a body's contact with the one that
it hangs on.
"""

from __future__ import annotations

from typing import Final

TERRAIN_CONTACT: Final = {"contype": 1, "conaffinity": 0}
ROBOT_CONTACT: Final = {"contype": 0, "conaffinity": 1}  # with the ground alone
LEG_CONTACT: Final = {"contype": 4, "conaffinity": 5}  # with the ground and with other legs
NO_CONTACT: Final = {"contype": 0, "conaffinity": 0}
STONE_CONTACT: Final = {"contype": 3, "conaffinity": 2}
GROUND_OF_STONES: Final = {"contype": 3, "conaffinity": 0}
