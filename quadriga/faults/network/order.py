"""What the radio of one place does to packets from now on, as a line of text."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

from quadriga.faults.network.link import LinkFaults


@dataclass(frozen=True, slots=True)
class RadioOrder:
    """One order.

    Attributes:
        place: whose radio, both ways.
        faults: of each way.
        seconds: how long; None: from now on.
    """

    place: str
    faults: LinkFaults
    seconds: float | None = None

    def to_line(self) -> str:
        """The order without the end of the line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_line(cls, line: str) -> RadioOrder:
        """The order that a line of `to_line` is."""
        given = json.loads(line)
        return cls(given["place"], LinkFaults(**given["faults"]), given["seconds"])
