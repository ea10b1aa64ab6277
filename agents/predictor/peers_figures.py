"""What a predictor says that robots do to each other, held against data that it has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from quadriga.shared.errors import PredictorError

LEFT_OUT: Final = 0.02  # of the effect of own forces: a smaller effect of peers is as good as none
UNDERSTATED: Final = 1.25  # slope above which the effect is certainly too small
MATERIAL: Final = 0.02  # of the squared error: a smaller harm is not worth a word


class Bounds(NamedTuple):
    """An estimate with its 95 % interval; None where the data do not tell."""

    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class PeersFigures:
    """The predicted effect of the peers' forces by output, in held-out windows of all robots.

    With p the part of a prediction that is due to the peers' forces within the horizon, and r what
    is measured less all other parts of the prediction. The forces of the data are random and
    independent of each other, so p explains as much of r as the peers really do.

    Attributes:
        share: norm of p for one peer over that of the part due to the robot's own forces.
        slope: Σ p r / Σ p²: 1 if the peers do what is predicted, 0 if p is invented, more than 1 if
            p is too small. Below 0.5 predictions are better without p.
        harm: (‖r − p‖² − ‖r‖²) / ‖r‖²: how much p raises the squared error; negative if it helps.
        harm_limit: a predictor whose harm is certainly above this is refused.
    """

    share: Mapping[str, float | None]
    slope: Mapping[str, Bounds]
    harm: Mapping[str, Bounds]
    harm_limit: float

    @classmethod
    def from_dict(cls, body: Mapping[str, Any]) -> PeersFigures:
        """The inverse of `asdict`, also after JSON has made lists of tuples.

        Raises:
            TypeError: fields are missing or unknown.
        """
        bounds = {
            name: {output: Bounds(*values) for output, values in body.get(name, {}).items()}
            for name in ("slope", "harm")
        }
        return cls(**{**body, **bounds})

    def check(self) -> None:
        """Refuse a predictor whose agents would respond to effects that are certainly not there.

        Raises:
            PredictorError: the effect of peers raises the error of an output beyond the limit.
        """
        for output, harm in self.harm.items():
            if harm.value is None or harm.low is None or not harm.low > self.harm_limit:
                continue
            raise PredictorError(
                f"predictor: effect of peers on {output}",
                f"{100 * harm.value:.0f} % more squared error on held-out data than without it",
                f"certainly at most {100 * self.harm_limit:g} %",
                "invented from noise: more data, or a larger identification.block_weight",
            )

    def verdict(self, output: str) -> str:
        """What the data say of the peers' effect on an output, in a word or two."""
        share, slope, harm = self.share[output], self.slope[output], self.harm[output]
        if harm.low is not None and harm.low > 0.0 and (harm.value or 0.0) > MATERIAL:
            return "invented"
        if share is None or share < LEFT_OUT:
            return "left out"
        if slope.low is not None and slope.low > UNDERSTATED:
            return "understated"
        if harm.high is not None and harm.high < 0.0:
            return "confirmed"
        return "unclear"

    def outputs_with(self, verdict: str) -> tuple[str, ...]:
        """The outputs of which the data say this."""
        return tuple(output for output in self.share if self.verdict(output) == verdict)

    def describe(self) -> str:
        """All that is wrong with the effect of the peers, in one line; "" if nothing is."""
        found = {word: self.outputs_with(word) for word in ("invented", "understated", "left out")}
        return "; ".join(f"{word}: {', '.join(names)}" for word, names in found.items() if names)
