"""Names of the entries of a message's arrays, for readers that know nothing of this project."""

from __future__ import annotations

from typing import Final

from quadriga.shared.robot.conventions import JOINT_NAMES, Leg

XYZ: Final = ("x", "y", "z")
WXYZ: Final = ("w", "x", "y", "z")
LEGS: Final = tuple(leg.name for leg in Leg)
JOINTS: Final = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FORCES: Final = tuple(f"{leg}.{axis}" for leg in LEGS for axis in XYZ)
ONE: Final = ("",)  # a single number, called as its field is
