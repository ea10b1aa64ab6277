"""Who looks rarely starves; a single pause is none."""

from __future__ import annotations

import numpy as np

from quadriga.recorder.starvation import PATIENCE, SHARE, WINDOW, Starvation


def looks(times: np.ndarray) -> list[bool]:
    starvation = Starvation(0.0)
    return [starvation.look(float(now)) for now in times]


def test_who_looks_often_does_not_starve() -> None:
    assert not any(looks(np.arange(0.0, 60.0, PATIENCE)))


def test_who_looks_rarely_starves_within_two_windows() -> None:
    every = PATIENCE / (1.0 - 1.5 * SHARE)  # 1.5 times the share of all time is waiting
    times = np.arange(0.0, 2.0 * WINDOW + every, every)
    assert any(looks(times))


def test_a_pause_now_and_then_is_none() -> None:
    pauses = np.cumsum([*([0.02] * 100), 0.2] * 20)
    assert not any(looks(pauses))


def test_who_was_stopped_starves_but_is_judged_anew_each_time() -> None:
    starvation = Starvation(0.0)
    assert starvation.look(5.0)
    assert not any(starvation.look(5.0 + 0.01 * k) for k in range(1, 500))
