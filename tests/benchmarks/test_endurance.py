import pytest

from benchmarks.endurance import grown


def samples(*values: float) -> list[tuple[float, float]]:
    return [(10.0 * k, value) for k, value in enumerate(values)]


def test_growth_is_of_the_time_after_a_walk_has_settled() -> None:
    start_up = [50.0] * 10 + [200.0] * 90
    assert grown(samples(*start_up)) == 0.0
    leaking = [100.0 + k for k in range(100)]
    assert grown(samples(*leaking)) == pytest.approx(195.0 / 115.0 - 1.0)
    shrinking = [100.0] * 50 + [90.0] * 50
    assert grown(samples(*shrinking)) == pytest.approx(-0.1)


def test_a_walk_of_one_sample_has_not_grown() -> None:
    assert grown(samples(100.0)) == 0.0
