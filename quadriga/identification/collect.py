"""Data collection: the team walks under random references and force noise, on both cores."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from quadriga.agents.gait import nominal_forces
from quadriga.agents.predictor.episode import SIGNALS, Episode, output_base
from quadriga.agents.predictor.hankel import required_samples
from quadriga.identification.dataset import Dataset
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config, WorldConfig
from quadriga.shared.errors import PredictorError
from quadriga.shared.messages import Reference
from quadriga.shared.modes import PASSIVE
from quadriga.shared.robots.conventions import N_FORCES, Array, robot_names
from quadriga.shared.topics import REFERENCE_EPOCH_MS as EPOCH_MS
from quadriga.shared.topics import SAMPLE_MS
from quadriga.workers import run_each

_LEAST: Final = 2000  # samples, however few the rule asks for
_LEAST_WRENCHES: Final = (20_000, 60_000)  # the same for net wrenches of one robot, of several
_MARGIN: Final = 2  # times what the rule asks for: data far in excess average the noise out
# Worlds of the disturbed episodes, in turn: keys of `WorldConfig`.
_DISTURBANCES: Final[tuple[Mapping[str, Any], ...]] = (
    {"terrain": "boxes"},
    {"push_force": 80.0},
    {"terrain": "boxes", "push_force": 80.0},
)
_LEAST_EPISODE_S = 3.0  # a walk that ended in a fall earlier is not worth keeping
_BEFORE_FALL = 50  # samples cut off before a fall
_CLIP = 2.5  # standard deviations of the force noise
_NOISE_HOLD_MS: Final = 20  # how long one draw of noise is held
N_COMPONENTS = 5  # of a net wrench that two feet on a diagonal can exert
_RAMP_MS = 500  # from one random speed to the next: jumps would drown what the forces do

Progress = Callable[[int, int], None]


def collect(config: Config, jobs: int, progress: Progress) -> Dataset:
    """Collect training and held-out episodes, `jobs` at a time, each with a seed of its own.

    Args:
        config: the team's configuration.
        jobs: processes to use.
        progress: called with episodes done and episodes in all.

    Raises:
        PredictorError: so many walks ended in a fall that too little is left.
        ProcessError: a worker died.
    """
    plan = plan_episodes(config)
    episodes: dict[int, Episode | None] = {}
    progress(0, len(plan))
    with closing(run_each(partial(collect_episode, config), plan, jobs)) as results:
        for planned, episode in results:
            episodes[planned.number] = episode
            progress(len(episodes), len(plan))
    return build_dataset(config, episodes)


def build_dataset(config: Config, episodes: Mapping[int, Episode | None]) -> Dataset:
    """The data set of all episodes that were not lost.

    Args:
        config: the team's configuration.
        episodes: by number, None for a walk that was lost to a fall.

    Raises:
        PredictorError: too little with force noise is left.
    """
    wanted, last = training_seconds(config), held_out_number(config)
    kept = {number: episode for number, episode in episodes.items() if episode is not None}
    training = {number: kept[number] for number in spread([*kept], last)}
    held_out = kept.get(last)
    samples = sum(episode.samples for number, episode in training.items() if number < last)
    if held_out is None or samples < 0.5 * wanted / (1e-3 * SAMPLE_MS):
        raise PredictorError(
            "data collection",
            f"{samples} samples, held-out episode {'kept' if held_out else 'lost'}",
            f"at least half of {100 * wanted:.0f} samples and a held-out episode",
            "the robots fall while collecting: smaller identification.noise, vx, vy or wz",
        )
    seeds = tuple(config.identification.seed + k for k in training)
    return Dataset(tuple(training.values()), (held_out,), seeds)


def collect_episode(config: Config, planned: PlannedEpisode) -> Episode | None:
    """One walk; None if the team fell too early for it to be of use."""
    config = collection_config(config, planned)
    seconds = planned.seconds
    walk = _RandomWalk(config, config.world.seed, round(1e3 * seconds) + config.gait.stand_ms)
    rollout = Rollout(config, None, walk.reference, walk.excitation)
    names = robot_names(config.team.robots)
    u, u_nominal, y, y_base = [], [], [], []
    weight = config.robot.weight
    first = config.gait.stand_ms + SAMPLE_MS
    gave_up = False  # an agent that gave up ends the episode as a fall does
    for tick in rollout.ticks(walk.ticks + 1):
        gave_up = any(out.mode == PASSIVE for out in tick.outputs.values())
        if gave_up:
            break
        if tick.tick % SAMPLE_MS or tick.tick < first:
            continue
        measurements = [tick.outputs[name].measurement for name in names]
        samples = [sample for sample in measurements if sample is not None]
        u.append([sample.u for sample in samples])
        u_nominal.append([nominal_forces(sample.stance > 0.5, weight) for sample in samples])
        y.append([sample.y for sample in samples])
        base = output_base(config, walk.reference_at(tick.tick))
        y_base.append([base] * len(names))
    keep = len(u) - _BEFORE_FALL if gave_up or rollout.world.fallen() else len(u)
    if keep * SAMPLE_MS < 1e3 * min(_LEAST_EPISODE_S, seconds):
        return None
    signals = (np.array(x[:keep]) for x in (u, u_nominal, y, y_base))
    return Episode(**dict(zip(SIGNALS, signals, strict=True)), first_tick=first)


def force_patterns(feet: Array) -> Array:
    """Forces of four feet that add up to net forces, and to couples that two of them can exert.

    Along x, y and z; vertical couple: the front feet up, the hind ones down; horizontal couple:
    every foot along the circle about the trunk. One newton at every foot. Shape (5, 12).

    Args:
        feet: where they are under the trunk, (4, 2), m.
    """
    patterns = np.zeros((N_COMPONENTS, len(feet), 3))
    patterns[[0, 1, 2], :, [0, 1, 2]] = 1.0
    patterns[3, :, 2] = np.sign(feet[:, 0])
    tangent = np.stack([-feet[:, 1], feet[:, 0]], axis=1)
    patterns[4, :, :2] = tangent / np.linalg.norm(tangent, axis=1)[:, None]
    return patterns.reshape(N_COMPONENTS, N_FORCES)


class _RandomWalk:
    """Random references and force noise of one episode, all drawn beforehand from its seed."""

    def __init__(self, config: Config, seed: int, ticks: int) -> None:
        ident = config.identification
        random = np.random.default_rng(seed)
        self.ticks = ticks
        self._hold = round(1e3 * ident.hold)
        draws = ticks // self._hold + 2
        low, high = np.array([ident.vx, ident.vy, ident.wz]).T
        self._speeds = random.uniform(low, high, size=(draws, 3))
        self._speeds[0] = 0.0
        shape = (ticks // _NOISE_HOLD_MS + 2, config.team.robots, 4, 3)
        noise = np.clip(random.normal(size=shape), -_CLIP, _CLIP) * np.array(ident.noise)
        together = random.choice([-1.0, 1.0], (*shape[:2], N_COMPONENTS)) * ident.wrench_noise
        patterns = force_patterns(config.robot.feet_under_hips)
        self._noise = noise.reshape(*shape[:2], N_FORCES) + together @ patterns
        self._index = {name: i for i, name in enumerate(robot_names(config.team.robots))}
        self._height = config.reference.height

    def reference_at(self, tick: int) -> Reference:
        """The reference in force at a tick."""
        start = tick // EPOCH_MS * EPOCH_MS
        draw, since = divmod(start, self._hold)
        share = min(1.0, since / _RAMP_MS) if draw else 0.0
        vx, vy, wz = (1.0 - share) * self._speeds[max(0, draw - 1)] + share * self._speeds[draw]
        return Reference(tick, tick * 1_000_000, vx, vy, wz, self._height)

    def reference(self, tick: int) -> Reference | None:
        """The reference as the operator would send it: every 100 ms."""
        return self.reference_at(tick) if tick % EPOCH_MS == 0 else None

    def excitation(self, robot: str, tick: int) -> Array:
        """Force noise of a robot at a tick. Shape (12,), N."""
        noise: Array = self._noise[tick // _NOISE_HOLD_MS, self._index[robot]]
        return noise


# ---- what is walked: how long, in which worlds, under which forces


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
