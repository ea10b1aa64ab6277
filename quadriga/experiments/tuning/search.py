"""SHELL of a search: generations of candidates by CMA-ES, each a campaign beside the start."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console

from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.campaign.walk_trials import Workers, walk_campaign
from quadriga.experiments.plan import CampaignPlan, build_plan
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.experiments.tuning.loss import by_world, loss
from quadriga.experiments.tuning.tuning_file import Tuning, look_up
from quadriga.experiments.variants import Variant
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.atomic import write_text

START: Final = "start"
TUNED: Final = "tuned"
SEARCH: Final = "search.json"
VARIANTS: Final = "variants.toml"
JUDGED: Final = "judged"


@dataclass(frozen=True, slots=True)
class Candidate:
    """One of a generation.

    Attributes:
        values: of the tuned numbers, by name.
        loss: see `loss`.
    """

    values: dict[str, float]
    loss: float


@dataclass(frozen=True, slots=True)
class Generation:
    """What came of the walks of a generation.

    Attributes:
        candidates: in the order in which they were drawn.
        start: loss of the start in the same worlds.
        mean: the values around which the next generation is drawn.
    """

    candidates: list[Candidate]
    start: float
    mean: dict[str, float]


def search(tuning: Tuning, out: Path, *, workers: Workers, typed: str, console: Console) -> None:
    """Walk every generation, then the result and the start on seeds of their own.

    The same search in the same folder goes on where it ended.

    Args:
        tuning: what is tuned.
        out: folder of all campaigns.
        workers: who walks.
        typed: the command, for the reports.
        console: for progress.

    Raises:
        ConfigError: see `walk_campaign`, or CMA-ES is not installed.
    """
    start = _start(tuning)
    strategy = _strategy(tuning, start)
    generations: list[Generation] = []
    for number in range(tuning.generations):
        drawn = [strategy.ask() for _ in range(tuning.population)]
        values = [_values(tuning, x) for x in drawn]
        plan = _plan(tuning, start, values, tuning.seeds_of(number))
        folder = out / f"generation-{number + 1:02d}"
        console.print(f"generation {number + 1} of {tuning.generations}")
        walk_campaign(plan, folder, workers=workers, typed=typed, console=console)
        generation = _judge(plan, read_rows(folder, read_manifest(folder)), values)
        losses = [candidate.loss for candidate in generation.candidates]
        strategy.tell(list(zip(drawn, losses, strict=True)))
        generation = Generation(
            generation.candidates, generation.start, _values(tuning, strategy.mean)
        )
        generations.append(generation)
        console.print(f"loss {min(losses):.3f} … {max(losses):.3f}, start {generation.start:.3f}")
        _write(tuning, start, generations, out)
    plan = _plan(tuning, start, [generations[-1].mean], tuning.judged_on, TUNED)
    walk_campaign(plan, out / JUDGED, workers=workers, typed=typed, console=console)


def _start(tuning: Tuning) -> Config:
    """The configuration that the search starts from.

    Raises:
        ConfigError: a tuned key, or the length of a walk, is not the same in all scenarios.
    """
    plan = build_plan(
        tuning.scenarios, (Variant(START, tuning.fixed),), (), tuning.seeds, START, None, {}
    )
    first, *others = plan.configs.values()
    tuning.start_values(first)
    for key in dict.fromkeys((*(tuned.key for tuned in tuning.keys), "world.duration")):
        found = {look_up(config, key) for config in (first, *others)}
        if len(found) > 1:
            raise ConfigError(
                "scenarios",
                f"{key} of {' and '.join(map(str, sorted(found)))}",
                "equal values in all scenarios",
                f"[fixed] sets {key} for all",
            )
    return first


def _strategy(tuning: Tuning, start: Config) -> Any:
    """CMA-ES (N. Hansen, arXiv:1604.00772) in the unit cube of the tuned numbers."""
    try:
        cmaes = import_module("cmaes")
    except ModuleNotFoundError as error:
        raise ConfigError(
            "quadriga tune",
            f"no package {error.name!r}",
            "the extra 'tune'",
            "pip install -e '.[tune]' in the checkout",
        ) from None
    values = tuning.start_values(start)
    return cmaes.CMA(
        mean=np.array([key.x(values[key.name]) for key in tuning.keys]),
        sigma=tuning.step,
        bounds=np.array([[0.0, 1.0]] * len(tuning.keys)),
        seed=tuning.seed,
        population_size=tuning.population,
    )


def _values(tuning: Tuning, x: Any) -> dict[str, float]:
    return {key.name: key.value(float(place)) for key, place in zip(tuning.keys, x, strict=True)}


def _plan(
    tuning: Tuning,
    start: Config,
    candidates: list[dict[str, float]],
    seeds: tuple[int, ...],
    name: str = "",
) -> CampaignPlan:
    """A campaign of the start and some candidates."""
    variants = [Variant(START, tuning.changes(start, tuning.start_values(start)))]
    for number, values in enumerate(candidates, 1):
        variants.append(Variant(name or f"c{number:02d}", tuning.changes(start, values)))
    return build_plan(tuning.scenarios, tuple(variants), (), seeds, START, None, {})


def _judge(
    plan: CampaignPlan, rows: list[TrialOutcome], values: list[dict[str, float]]
) -> Generation:
    seconds = next(iter(plan.configs.values())).world.duration
    walks = [
        by_world(row for row in rows if row.variant == variant.name) for variant in plan.variants
    ]
    losses = [loss(mine, walks[0], seconds) for mine in walks]
    candidates = [Candidate(*pair) for pair in zip(values, losses[1:], strict=True)]
    return Generation(candidates, losses[0], {})


def _write(tuning: Tuning, start: Config, generations: list[Generation], out: Path) -> None:
    """The search so far as JSON; the start and where it led as variants of a campaign."""
    body = {
        "title": tuning.title,
        "start": tuning.start_values(start),
        "generations": [
            {
                "start_loss": generation.start,
                "candidates": [
                    {"loss": candidate.loss, "values": candidate.values}
                    for candidate in generation.candidates
                ],
                "mean": generation.mean,
            }
            for generation in generations
        ],
    }
    write_text(out / SEARCH, json.dumps(body, indent=1) + "\n")
    found = {
        START: tuning.changes(start, tuning.start_values(start)),
        TUNED: tuning.changes(start, generations[-1].mean),
    }
    lines = []
    for name, keys in found.items():
        lines.append(f"[{name}]")
        lines += [f'"{key}" = {_toml(value)}' for key, value in keys.items()]
        lines.append("")
    write_text(out / VARIANTS, "\n".join(lines))


def _toml(value: Any) -> str:
    """JSON's text of numbers, texts and lists of them is TOML's."""
    return json.dumps(value)
