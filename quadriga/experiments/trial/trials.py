"""Which trials a comparison consists of, and the configuration each is walked with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from quadriga.experiments.trial.variants import PLANNERS, PREDICTORS, SCENARIOS, named_as, with_keys
from quadriga.shared.config.sections import Config

NO_PREDICTOR: Final = ""  # of a trial without a planner


@dataclass(frozen=True, slots=True)
class Trial:
    """One walk of a comparison, by names of `quadriga.experiments.trial.variants`."""

    planner: str
    predictor: str
    scenario: str
    seed: int


@dataclass(frozen=True, slots=True)
class Choice:
    """What to compare, by names of `quadriga.experiments.trial.variants`.

    Attributes:
        product: every planner with every predictor; else planners with the configured predictor
            and predictors with the configured planner.
    """

    planners: tuple[str, ...]
    predictors: tuple[str, ...]
    scenarios: tuple[str, ...]
    seeds: tuple[int, ...]
    product: bool = False


def trials(config: Config, choice: Choice) -> list[Trial]:
    """Every trial of a comparison, each once, those of one world beside each other."""
    planner, predictor = named_as(config, PLANNERS), named_as(config, PREDICTORS)
    pairs = [(p, predictor) for p in choice.planners] + [(planner, q) for q in choice.predictors]
    if choice.product:
        pairs = [(p, q) for p in choice.planners for q in choice.predictors]
    blind = {p for p, _ in pairs if with_keys(config, PLANNERS[p]).planner.kind == "none"}
    distinct = dict.fromkeys((p, NO_PREDICTOR if p in blind else q) for p, q in pairs)
    return [
        Trial(*pair, scenario, seed)
        for scenario in choice.scenarios
        for seed in choice.seeds
        for pair in distinct
    ]


def config_of(config: Config, trial: Trial) -> Config:
    """The configuration a trial is walked with."""
    fit = PREDICTORS[trial.predictor] if trial.predictor else {}
    world = {**SCENARIOS[trial.scenario], "world.seed": trial.seed, "world.mode": "lockstep"}
    return with_keys(config, {**PLANNERS[trial.planner], **fit, **world})
