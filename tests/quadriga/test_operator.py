"""What the operator asks for: nothing while the team stands, then a ramp."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.operator import reference_at
from shared.config import Config
from shared.config_file import load


def test_stand_then_ramp_then_full_speed() -> None:
    config = load(None, {"reference.vx": 0.4, "reference.wz": -0.2, "reference.ramp": 2.0})
    speeds = [reference_at(config, tick).vx for tick in (0, 300, 800, 1300, 2300, 9000)]
    assert speeds == pytest.approx([0.0, 0.0, 0.1, 0.2, 0.4, 0.4])
    assert reference_at(config, 1300).wz == pytest.approx(-0.1)
    assert reference_at(config, 1300).tick == 1300
    assert reference_at(config, 1300).stamp_ns == 1_300_000_000


def test_without_a_ramp_full_speed_starts_with_the_first_step() -> None:
    config = load(None, {"reference.ramp": 0.0})
    assert [reference_at(config, tick).vx for tick in (0, 299, 300)] == [0.0, 0.0, 0.5]


def test_height_is_asked_for_from_the_start() -> None:
    assert reference_at(Config(), 0).height == Config().reference.height


def test_a_trace_is_followed_from_the_first_step_on(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_text("t,vx,vy,wz\n0,0,0,0\n2,0.4,0.2,-0.2\n4,0,0,0\n", encoding="utf-8")
    config = load(None, {"reference.trace": str(path), "reference.ramp": 1.0})
    asked = [reference_at(config, tick) for tick in (0, 300, 800, 2300, 4300, 6300)]
    assert [r.vx for r in asked] == pytest.approx([0.0, 0.0, 0.05, 0.4, 0.0, 0.4])
    assert (asked[3].vy, asked[3].wz) == pytest.approx((0.2, -0.2))
    assert asked[3].height == Config().reference.height
