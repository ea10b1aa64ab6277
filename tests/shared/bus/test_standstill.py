"""Who did not run says so; who worked, or had not begun, did not stand still."""

from __future__ import annotations

import pytest

from quadriga.shared.bus.standstill import Standstill


@pytest.mark.parametrize(
    ("passed", "worked", "stood"),
    [(0.05, 0.0, 0.0), (20.0, 0.0, 20.0), (20.0, 19.0, 0.0), (20.0, 5.0, 15.0), (1.9, 0.0, 0.0)],
)
def test_time_in_which_nothing_was_done_is_told(
    capsys: pytest.CaptureFixture[str], passed: float, worked: float, stood: float
) -> None:
    now, work = [100.0], [0]
    still = Standstill(lambda: now[0], lambda: work[0])
    now[0] += 60.0  # it waits for its team, and does not look
    still.look()
    still.begin()
    now[0], work[0] = now[0] + passed, round(1e9 * worked)
    still.look()
    still.look()
    assert still.total == pytest.approx(stood)
    said = capsys.readouterr().err
    assert said.count(f"this process stood still for {stood:.1f} s") == (stood > 0.0)
    assert bool(still.note) is bool(said) is (stood > 0.0)
    now[0] += 1.5
    still.look()
    assert bool(still.note) is (stood > 0.0), "what is missed right after it is its own fault"
    for _ in range(6):
        now[0] += 1.9
        still.look()
    assert not still.note
