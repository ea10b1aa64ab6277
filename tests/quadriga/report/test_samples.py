"""What a page tells of feet where nobody knows the truth."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.report.samples import contact_by_sensors
from quadriga.shared.config.load import load

LOAD = np.array([0.0, 0.0, 15.0, 60.0, 60.0])  # N


@pytest.mark.parametrize(
    ("sensor", "scale", "bias", "touching"),
    [
        ("newtons", 1.0, 0.0, [False, False, True, True, True]),
        ("counts", 2.0, -70.0, [False, False, False, True, True]),
    ],
)
def test_contact_is_told_from_newtons_and_from_counts(
    sensor: str, scale: float, bias: float, touching: list[bool]
) -> None:
    config = load(None, {"sensors.foot_sensor": sensor, "controller.contact_force": 10.0})
    force = np.tile((scale * LOAD + bias)[:, None], (1, 4))
    assert config.feet_measure_newtons is (sensor == "newtons")
    assert contact_by_sensors(force, config).tolist() == [[one] * 4 for one in touching]


def test_no_samples_are_no_contacts() -> None:
    assert contact_by_sensors(np.zeros((0, 4)), load(None, {})).shape == (0, 4)
