"""What a probe came to: the true responses, and each predictor's figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from quadriga.agents.predictor.store import versions
from quadriga.experiments.probe.comparison import (
    MEANINGS,
    ByOutput,
    ResponseComparison,
    compare,
    predict_responses,
    truth_figures,
)
from quadriga.experiments.probe.probed import Probed
from quadriga.experiments.probe.pulses import DIRECTIONS, DIRECTIONS_TEXT, FORCE, PULSE_MS
from quadriga.experiments.probe.responses import Responses
from quadriga.shared.config.sections import Config, GaitConfig
from quadriga.shared.config.write import config_sha256
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.topics import SAMPLE_MS

_FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class PredictorOutcome:
    """A predictor held against the truth; `predicted` is what it says, as `Responses.y`."""

    name: str
    sha256: str
    refused: str
    comparison: ResponseComparison
    predicted: Array


@dataclass(frozen=True, slots=True)
class ProbeOutcome:
    """All that a probe tells.

    Attributes:
        config: of the team.
        responses: the truth.
        truth: figures of the truth itself.
        phase_ms: time of each phase's pulses in the gait's period.
        predictors: figures of each; the configured one, or the first one asked for, comes first.
    """

    config: Config
    responses: Responses
    truth: Mapping[str, ByOutput]
    phase_ms: tuple[int, ...]
    predictors: tuple[PredictorOutcome, ...]

    @property
    def title(self) -> str:
        """The team and its ground, in a few words."""
        team, world = self.config.team, self.config.world
        robots = "1 robot" if team.robots == 1 else f"{team.robots} robots, yokes {team.yokes}"
        return f"{robots}, {world.scenario or world.ground}"

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can carry: the first predictor's figures, then those of each."""
        responses, config = self.responses, self.config
        details = [self._describe(each) for each in self.predictors]
        return {
            "format": _FORMAT,
            **details[0],
            **self.truth,
            "predictors": details,
            "robots": config.team.robots,
            "yokes": config.team.yokes,
            "scenario": config.world.scenario,
            "seeds": list(responses.seeds),
            "pulses": responses.pulses,
            "lost_to_falls": responses.lost,
            "pulse": {"force_n": FORCE, "ms": PULSE_MS, "directions": list(DIRECTIONS)},
            "horizon_ms": SAMPLE_MS * config.planner.N,
            "meanings": {**MEANINGS, "directions": DIRECTIONS_TEXT},
            "config_sha256": config_sha256(config),
            "config": asdict(config),
            "versions": versions(),
        }

    def _describe(self, each: PredictorOutcome) -> dict[str, Any]:
        names, comparison = robot_names(self.config.team.robots), each.comparison
        figures = zip(self.phase_ms, comparison.by_phase, strict=True)
        return {
            "predictor": each.name,
            "sha256": each.sha256,
            "refused": each.refused,
            **comparison.overall,
            "phases": [{"phase_ms": time, **figure} for time, figure in figures],
            "directions": dict(comparison.by_direction),
            "pairs": [
                {"pulse": pulsed, "response": responding, **comparison.by_pair[i][j]}
                for i, responding in enumerate(names)
                for j, pulsed in enumerate(names)
                if i != j
            ],
        }


def build_outcome(config: Config, responses: Responses, probed: list[Probed]) -> ProbeOutcome:
    """Hold predictors against the truth.

    Args:
        config: of the team.
        responses: the truth.
        probed: at least one predictor of this team and horizon.
    """
    period, stand = 2 * config.gait.stance_ms, config.gait.stand_ms
    return ProbeOutcome(
        config=config,
        responses=responses,
        truth=truth_figures(responses),
        phase_ms=tuple(((responses.ticks - stand) % period).tolist()),
        predictors=tuple(_hold_against(config.gait, responses, each) for each in probed),
    )


def _hold_against(gait: GaitConfig, responses: Responses, probed: Probed) -> PredictorOutcome:
    predicted = predict_responses(responses, probed.predictor, gait)
    comparison = compare(responses.y, predicted)
    return PredictorOutcome(probed.name, probed.sha256, probed.refused, comparison, predicted)
