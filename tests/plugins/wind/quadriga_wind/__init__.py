"""A topic that quadriga does not know: the wind."""

from __future__ import annotations

from quadriga.shared.messages import Message, array, plain
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.record import record
from quadriga.shared.topic import Topic


@record
class Wind(Message):
    """The wind at the anemometer, mean over the time since the message before."""

    velocity: Array = array(3, entries=("x", "y", "z"), unit="m/s", frame="world")
    station: str = plain(str, "where the anemometer stands")


WIND = Topic("wind", Wind, ("anemometer",), (), period_ms=100, max_age_ms=1000)
