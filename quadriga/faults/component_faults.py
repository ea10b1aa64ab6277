"""Faults of sensors and motors, which the simulated world makes itself, in lock-step."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.faults.fault import Draw, SetStage, Stage, TeamFault
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import robot_names
from quadriga.sim_server.world.faults import KINDS, build_components, parse_faults

_SHORT_S: Final = 0.5  # of a component that is faulty for a while
_COMPONENTS: Final = (  # as in `world.faults`, in words, and how long: None is from then on
    ("imu", "imu", "imu", _SHORT_S),
    ("encoder", "encoder_FL_calf", "a knee's encoder", _SHORT_S),
    ("feet", "feet", "feet", None),
    ("knee", "motor_FL_calf", "a knee's motor", _SHORT_S),
)


def _stage(fault: str, seconds: float | None) -> SetStage:
    @contextmanager
    def stage(config: Config, draw: Draw, _folder: Path) -> Iterator[Stage]:
        text = f"{draw.robot}/{fault} {1e-3 * draw.tick:g}"
        text += "" if seconds is None else f" {seconds:g}"
        world = replace(
            config.world, faults=text, duration=config.world.duration + (seconds or 0.0)
        )
        yield Stage(replace(config, world=world))

    return stage


def _build() -> Iterator[TeamFault]:
    for name, component, what, seconds in _COMPONENTS:
        time = "for good" if seconds is None else f"for {seconds:g} s"
        for kind in KINDS:
            stage = _stage(f"{component} {kind}", seconds)
            yield TeamFault(f"{name}-{kind}", f"{what} {kind} {time}", stage, realtime=False)


COMPONENT_FAULTS: Final = tuple(_build())
"""In the order of the table."""


def given_component_fault(text: str, config: Config) -> TeamFault:
    """The fault of one component that a text describes as `world.faults` does.

    Raises:
        ConfigError: the text does not follow the grammar, or names what there is not.
    """
    robots = robot_names(config.team.robots)
    (fault,) = parse_faults(text, robots, tuple(build_components(config.robot)))

    @contextmanager
    def stage(config: Config, _draw: Draw, _folder: Path) -> Iterator[Stage]:
        after_s = 0.0 if fault.stop is None else 1e-3 * (fault.stop - fault.start)
        world = replace(config.world, faults=text, duration=config.world.duration + after_s)
        yield Stage(replace(config, world=world))

    return TeamFault(text, fault.detail, stage, realtime=False, given=(fault.robot, fault.start))
