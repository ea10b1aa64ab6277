"""What a data collection walks: how long, in which worlds, under which forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from quadriga.agents.predictor.hankel import required_samples
from quadriga.shared.config.sections import Config, WorldConfig
from quadriga.shared.robot.conventions import N_FORCES
from quadriga.shared.wire.topics import SAMPLE_MS

_LEAST: Final = 2000  # samples, however few the rule asks for
_LEAST_WRENCHES: Final = (20_000, 60_000)  # the same for net wrenches of one robot, of several
_MARGIN: Final = 2  # times what the rule asks for: data far in excess average the noise out
# Worlds of the disturbed episodes, in turn: keys of `WorldConfig`.
_DISTURBANCES: Final[tuple[Mapping[str, Any], ...]] = (
    {"terrain": "boxes"},
    {"push_force": 80.0},
    {"terrain": "boxes", "push_force": 80.0},
)


@dataclass(frozen=True, slots=True)
class PlannedEpisode:
    """One walk to collect.

    Attributes:
        number: with that of the collection, it makes the walk's seed.
        seconds: world time.
        disturbance: of a walk without force noise, what of its world is not as by default; None: a
            walk with force noise on flat, empty ground.
    """

    number: int
    seconds: float
    disturbance: Mapping[str, Any] | None = None


def training_seconds(config: Config) -> float:
    """World time to walk with force noise: as configured, or what the team's size asks for."""
    if config.identification.seconds > 0.0:
        return config.identification.seconds
    n = config.team.robots
    rule = required_samples(
        N_FORCES * n,
        config.planner.T_ini,
        config.planner.N,
        config.identification.order_per_robot * n,
    )
    least = _LEAST
    if any(config.identification.wrench_noise):
        # What peers do is a fraction of what a robot does itself, and is to be told from noise.
        least = _LEAST_WRENCHES[n > 1]
    return 1e-3 * SAMPLE_MS * max(least, _MARGIN * rule)


def collection_seconds(config: Config) -> float:
    """World time of the whole collection."""
    return sum(episode.seconds for episode in plan_episodes(config))


def plan_episodes(config: Config) -> tuple[PlannedEpisode, ...]:
    """All walks to collect: with force noise, the one held out, without noise but disturbed."""
    wanted, held_out = training_seconds(config), held_out_number(config)
    disturbed = round(config.identification.disturbed * held_out)
    seconds = wanted / held_out
    return (
        *(PlannedEpisode(number, seconds) for number in range(held_out)),
        PlannedEpisode(held_out, config.identification.held_out),
        *(
            PlannedEpisode(held_out + 1 + k, seconds, _DISTURBANCES[k % len(_DISTURBANCES)])
            for k in range(disturbed)
        ),
    )


def held_out_number(config: Config) -> int:
    """Number of the episode that is held out; those with smaller ones have force noise too."""
    return max(2, round(training_seconds(config) / config.identification.episode))


def collection_config(config: Config, episode: PlannedEpisode) -> Config:
    """The same team without a planner, on flat, empty ground as it is by default, or disturbed.

    So what is learnt does not depend on the world that is walked in later, which nobody knows.
    """
    planner, ident = replace(config.planner, kind="none"), config.identification
    world = WorldConfig(seed=ident.seed + episode.number, **(episode.disturbance or {}))
    if episode.disturbance is not None:
        silent = (0.0,) * len(ident.noise), (0.0,) * len(ident.wrench_noise)
        ident = replace(ident, noise=silent[0], wrench_noise=silent[1])
    return replace(config, world=world, planner=planner, identification=ident)


def spread(numbers: Sequence[int], held_out: int) -> list[int]:
    """The numbers in an order in which disturbed episodes lie evenly between the others.

    A fit that chooses its penalties by the last part of the data then has both kinds there.

    Args:
        numbers: of the episodes that were kept.
        held_out: number of the one that is held out, which is left out here.
    """
    noisy = sorted(number for number in numbers if number < held_out)
    disturbed = sorted(number for number in numbers if number > held_out)
    # Both kinds as shares of their own way; of two at the same place the disturbed one is later.
    places = [((k + 1) / len(noisy), 0, number) for k, number in enumerate(noisy)]
    places += [((k + 1) / len(disturbed), 1, number) for k, number in enumerate(disturbed)]
    return [number for *_, number in sorted(places)]
