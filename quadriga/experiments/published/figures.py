"""The figures of an experiment by name, as files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from matplotlib.backends.backend_agg import FigureCanvasAgg

from quadriga.experiments.figures import (
    FigurePart,
    SweepPanel,
    build_falls,
    build_ratios,
    build_success,
    build_sweeps,
)
from quadriga.experiments.published.experiment import Experiment
from quadriga.experiments.results import POOLED, Results, World

_DPI: Final = 90


def draw_figure(name: str, experiment: Experiment, results: Results, path: Path) -> bool:
    """Write a figure, one of `FIGURES`; False if there is nothing to draw yet."""
    part = FIGURES[name](experiment, results)
    if part is None:
        return False
    figure = part.draw()
    FigureCanvasAgg(figure)
    # Without the version of what drew it, which would be the only thing to change now and then.
    figure.savefig(path, format="png", dpi=_DPI, metadata={"Software": None})
    return True


def _sweeps(experiment: Experiment, results: Results) -> FigurePart | None:
    return build_sweeps(
        results,
        [
            SweepPanel(part.folder, part.axis, [(world[1], world) for world in part.worlds()])
            for part in experiment.parts
            if part.sweep is not None
        ],
    )


FIGURES: Final[Mapping[str, Callable[[Experiment, Results], FigurePart | None]]] = {
    "success": lambda asked, found: build_success(found, _limits(asked)),
    "falls": lambda asked, found: build_falls(found, _limits(asked)),
    "ratios": lambda asked, found: build_ratios(found, asked.published.ratios, _limits(asked)),
    "sweep": _sweeps,
}


def _limits(experiment: Experiment) -> Callable[[str, str, World], Iterator[float]]:
    """What is required of a variant's figure in a world."""

    def find(variant: str, measure: str, world: World) -> Iterator[float]:
        for asked in experiment.requirements:
            # A figure shows what is compared with the baseline, and each world for itself.
            shown = not (asked.moonshot or asked.against or asked.at_least)
            if asked.measure == measure and variant in asked.variants and shown:
                there = asked.each and world[0] in (asked.scenarios or (world[0],))
                if asked.pooled if world == POOLED else there:
                    yield asked.limit

    return find
