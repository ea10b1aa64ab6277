"""The figure of a changed replay shows what has changed most, and by how much."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.charts.panels import DEGREES, Panel
from quadriga.replay import figure
from quadriga.replay.figure import Curves, draw
from quadriga.shared.errors import RecordingError
from quadriga.shared.messages import Measurement


def curves() -> Curves:
    found = Curves(4)
    for tick in range(0, 1000, 10):
        y = np.full(6, np.sin(tick))
        changed = y.copy()
        changed[2] += 0.5
        stance = np.ones(4)
        found.add(
            Measurement(tick, 0, np.zeros(12), y, stance),
            Measurement(tick, 0, np.zeros(12), changed, stance),
        )
    return found


def test_the_component_that_has_changed_most_is_shown(tmp_path: Path) -> None:
    found = curves()
    assert found.most_changed_component("output") == 2
    draw(found, "r1 of a/run.mcap: planner.mu=0.3", tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_angles_are_read_in_degrees_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Panel] = []
    monkeypatch.setattr(figure, "draw_panels", lambda panels, *_, **__: drawn.extend(panels))
    monkeypatch.setattr(figure, "save_png", lambda *_: None)
    found = Curves(4)
    stance = np.ones(4)
    for tick in range(0, 1000, 10):
        y, changed = np.zeros(6), np.array([0, 0, 0, 0.1, 0, 0])
        messages = [Measurement(tick, 0, np.zeros(12), each, stance) for each in (y, changed)]
        found.add(*messages)
    draw(found, "roll", tmp_path / "a.png")
    turned = [panel for panel in drawn if panel.beside is not None]
    assert turned[0].title == "estimated output: roll [rad]"
    assert [panel.beside for panel in turned] == [DEGREES, DEGREES]


def test_a_figure_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="a file that can be written"):
        draw(curves(), "", tmp_path / "no" / "a.png")
