"""A command of arrays or single numbers, and of nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.controller import build_command
from quadriga.shared.errors import ProcessError
from tests.a1 import q_stand, standing


def test_numbers_count_for_all_joints_and_arrays_for_each() -> None:
    made = build_command(standing(7), q_des=q_stand(), kp=80.0, kd=[3.0] * 12)
    assert (made.tick, made.stamp_ns) == (7, 7_000_000)
    assert np.array_equal(made.q_des, q_stand())
    assert np.array_equal(made.kp, np.full(12, 80.0))
    assert np.array_equal(made.kd, np.full(12, 3.0))
    assert not made.tau.any()
    assert not made.v_des.any()


def test_another_shape_is_refused_by_name() -> None:
    with pytest.raises(ProcessError, match=r"command\.tau: got shape \(4, 3\), expected"):
        build_command(standing(7), tau=np.zeros((4, 3)))
