"""Who has not said that it has stopped, after an emergency stop."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.drive.stop_proof import unconfirmed
from quadriga.shared.codes import ESTOPPED, FALL, ROBOT_STOPPED
from quadriga.shared.messages import Event, Status

ROBOTS = ("r1", "r2")


def says(mode: str) -> Status:
    return Status(5, 0, mode, "", "kalman", {}, {}, np.zeros(0), np.zeros(0))


STOPPED = dict.fromkeys(ROBOTS, says("estop"))
OF_ALL = [Event.of(5, ESTOPPED, "", "dog")]


@pytest.mark.parametrize("modes", [{}, {"r1": "estop"}, {"r1": "estop", "r2": "damping"}])
def test_every_agent_must_say_so_itself(modes: dict[str, str]) -> None:
    statuses = {name: says(mode) for name, mode in modes.items()}
    absent = [name for name in ROBOTS if modes.get(name) != "estop"]
    assert unconfirmed(ROBOTS, statuses, OF_ALL, plant_each=False) == absent
    assert not unconfirmed(ROBOTS, STOPPED, OF_ALL, plant_each=False)


def test_and_so_must_whoever_moves_the_motors() -> None:
    fallen = [Event.of(5, FALL, "", "")]
    assert unconfirmed(ROBOTS, STOPPED, fallen, plant_each=False) == ["plant"]
    assert unconfirmed(ROBOTS, STOPPED, OF_ALL, plant_each=True) == ["plant r1", "plant r2"]
    one = [Event.of(5, ROBOT_STOPPED, "r2", "")]
    assert unconfirmed(ROBOTS, STOPPED, one, plant_each=True) == ["plant r1"]


def test_before_the_walk_the_plant_of_a_robot_speaks_for_its_agent_too() -> None:
    stopped = [Event.of(0, ROBOT_STOPPED, name, "") for name in ROBOTS]
    assert not unconfirmed(ROBOTS, {}, stopped, plant_each=True)
    assert unconfirmed(ROBOTS, {}, stopped[:1], plant_each=True) == ["r2", "plant r2"]
