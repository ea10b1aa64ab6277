"""How a walk ends: what every loop of a plant returns."""

from __future__ import annotations

from typing import Final, NamedTuple

from quadriga.shared import codes


class End(NamedTuple):
    """Why a walk is over: a code of `quadriga.shared.codes.EVENTS`, and prose."""

    code: str
    detail: str


TOLD_TO_STOP: Final = End(codes.SIGNAL, "signal")
