"""Figures that many worlds share."""

from __future__ import annotations

from itertools import combinations

import pytest
from matplotlib.text import Text

from quadriga.experiments.published.figures import FIGURES
from tests.quadriga.experiments.published.made import experiment_of, upright
from tests.quadriga.experiments.published.test_summarise_experiment import of


@pytest.mark.parametrize("count", [5, 6, 9, 12])
def test_no_title_runs_into_another(count: int) -> None:
    worlds = [f"payload-uneven-{k}" for k in range(count)]
    experiment = experiment_of(*worlds)
    part = FIGURES["success"](experiment, of(experiment, range(10), upright))
    assert part is not None
    figure = part.draw()
    figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text)]
    places = {text.get_text(): text.get_window_extent() for text in texts}
    titles = [places[title] for title in (*worlds, "all worlds")]
    assert not any(one.overlaps(other) for one, other in combinations(titles, 2))
    assert all(title.x1 <= figure.bbox.width for title in titles)
