"""The figure of fit reports: angles are read in degrees, too."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from quadriga.identification import fit_figure
from quadriga.identification.fit_report import FitReport, HorizonErrors
from quadriga.shared.robot.conventions import OUTPUTS


def test_degrees_stand_beside_milliradians(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = HorizonErrors(np.full((5, 6), 0.02), np.full((5, 6), np.deg2rad(2.0)))
    report = cast(FitReport, SimpleNamespace(name="ridge", refused=None, horizon=errors))
    drawn = list[Figure]()
    monkeypatch.setattr(fit_figure, "save_png", lambda figure, _path: drawn.append(figure))
    fit_figure.draw([report], Path("fit.png"))
    (figure,) = drawn
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()

    def beside(axes: Any) -> list[str]:
        return [label.get_text() for other in axes.child_axes for label in other.get_yticklabels()]

    by_name = dict(zip(OUTPUTS, map(beside, figure.axes), strict=True))
    assert not by_name["z"] + by_name["vx"] + by_name["vy"]
    for name, sign in (("roll", "°"), ("pitch", "°"), ("wz", "°/s")):
        assert f"2{sign}" in by_name[name]
