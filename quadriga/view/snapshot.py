"""The newest of all that was heard of a team: what a picture is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from quadriga.shared.messages import Measurement, Plan, Reference, State, Status, Truth
from quadriga.view.placement import Placement


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The newest message of each kind, by robot where each sends its own.

    Attributes:
        tick: world time of the newest state or truth, ms.
        places: where robots are by their own account.
    """

    tick: int = 0
    truth: Truth | None = None
    reference: Reference | None = None
    states: Mapping[str, State] = field(default_factory=dict)
    measurements: Mapping[str, Measurement] = field(default_factory=dict)
    plans: Mapping[str, Plan] = field(default_factory=dict)
    statuses: Mapping[str, Status] = field(default_factory=dict)
    places: Mapping[str, Placement] = field(default_factory=dict)
