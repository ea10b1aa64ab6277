"""The file of the truth: what it says is what the world says, complete however it ends."""

from __future__ import annotations

import csv
from contextlib import suppress
from pathlib import Path

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.shared.wire.messages import Truth
from quadriga.sim_server.native.truth_log import COLUMNS, TruthLog, truth_row
from quadriga.sim_server.world.world import World

angles = st.floats(-1.5, 1.5)


def test_rows_are_the_truth_of_their_ticks(tmp_path: Path) -> None:
    world, file = World(load(overrides={"team.robots": 2})), tmp_path / "truth.csv"
    truths = list[Truth]()
    with suppress(KeyboardInterrupt), TruthLog(file, world.names) as log:
        for _ in range(250):
            truths.append(world.truth())
            log.note(truths[-1])
            world.step({})
        raise KeyboardInterrupt
    header, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    assert header == ["ms", *(f"{name}_{c}" for name in ("r1", "r2") for c in COLUMNS)]
    assert [int(row[0]) for row in rows] == list(range(250))
    numbers = np.array([[float(cell) for cell in row[1:]] for row in rows])
    assert np.abs(numbers - [truth_row(truth) for truth in truths]).max() <= 1e-5
    np.testing.assert_allclose(numbers[:, 9:12], [t.base_pos[1] for t in truths], atol=1e-5)
    np.testing.assert_allclose(numbers[:, 6:8], [t.base_vel[0, :2] for t in truths], atol=1e-5)
    np.testing.assert_allclose(numbers[:, 8], [t.base_omega[0, 2] for t in truths], atol=1e-5)


@given(angles, angles, angles)
def test_angles_are_those_that_turn_the_trunk(roll: float, pitch: float, yaw: float) -> None:
    world = World(load(overrides={"team.robots": 1}))
    turn = pinocchio.Quaternion(pinocchio.rpy.rpyToMatrix(roll, pitch, yaw))
    world.physics.qpos[3:7] = [turn.w, turn.x, turn.y, turn.z]
    np.testing.assert_allclose(truth_row(world.truth())[3:6], [roll, pitch, yaw], atol=1e-9)


def test_a_file_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"truth.csv: got No such file or directory, expected a"):
        TruthLog(tmp_path / "nowhere" / "truth.csv", ("r1",))
