"""The trials of a campaign: every variant in the same worlds, each group with its configuration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Final

from quadriga.experiments.sweep import Sweep
from quadriga.experiments.variants import Variant
from quadriga.shared.config.load import build, layers, overlay
from quadriga.shared.config.presets import PRESETS, preset_keys
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.sim_server.world.world import World
from quadriga.team import scenarios
from quadriga.team.controller_program import check_controller

_TOGETHER: Final = 8  # seeds that are walked by every variant before the next ones
_OURS: Final = ("world.seed", "world.mode")  # keys that a campaign sets itself


@dataclass(frozen=True, slots=True, order=True)
class Group:
    """Trials that differ by their seed alone."""

    scenario: str
    variant: str
    swept: tuple[str, ...]

    @property
    def name(self) -> str:
        """For files: no path and no shell takes it for anything else."""
        parts = (self.scenario, self.variant, *self.swept)
        return "-".join("".join(c if c.isalnum() or c in "_.+" else "_" for c in p) for p in parts)

    @property
    def world(self) -> tuple[str, ...]:
        """What it shares with the groups it is compared with."""
        return (self.scenario, *self.swept)


@dataclass(frozen=True, slots=True)
class CampaignPlan:
    """What is to be walked.

    Attributes:
        scenarios: the file of each, by name.
        configs: the configuration of each group, with seed 0.
        baseline: the variant that the others are compared with.
    """

    scenarios: Mapping[str, Path]
    variants: tuple[Variant, ...]
    sweeps: tuple[Sweep, ...]
    seeds: tuple[int, ...]
    baseline: str
    configs: Mapping[Group, Config]

    def trials(self) -> list[tuple[Group, int]]:
        """Every trial, those of a few seeds together, so that nearly all that is done is pairs.

        Within these one group after the other, so that a worker keeps its agents for a while.
        """
        few = [self.seeds[k : k + _TOGETHER] for k in range(0, len(self.seeds), _TOGETHER)]
        return [(group, seed) for seeds in few for group in self.configs for seed in seeds]


def build_plan(
    names: Sequence[str],
    variants: tuple[Variant, ...],
    sweeps: tuple[Sweep, ...],
    seeds: tuple[int, ...],
    baseline: str | None,
    file: Path | None,
    overrides: Mapping[str, Any],
) -> CampaignPlan:
    """The plan of a campaign.

    A later one of these wins: the defaults, the scenario, `file`, `overrides`, the variant, what
    is swept.

    Raises:
        ConfigError: an unknown scenario or baseline, a world that cannot be built, or a controller
            that cannot be started.
    """
    if not names:
        raise ConfigError("scenarios", "none", "at least one name or TOML file")
    for key in _OURS:
        if key in overrides:
            raise ConfigError(key, repr(overrides[key]), "--seeds", "a campaign sets it itself")
    files = _files(names)
    if baseline is None:
        known = [variant.name for variant in variants]
        baseline = "none" if "none" in known else known[0]
    elif baseline not in {variant.name for variant in variants}:
        raise ConfigError("--baseline", repr(baseline), "one of the variants compared")
    _check_sweeps(sweeps)
    given = {
        name: layers(file, {scenarios.LABEL: name, **overrides}, beneath=path)
        for name, path in files.items()
    }
    configs = {}
    for name, points, variant in product(
        files, product(*(sweep.values for sweep in sweeps)), variants
    ):
        keys = dict(zip((sweep.key for sweep in sweeps), points, strict=True))
        for key in variant.keys.keys() & {*keys, *_OURS, *_keys_of_presets(keys)}:
            raise ConfigError(
                f"variant {variant.name}: {key}",
                repr(variant.keys[key]),
                "a key that is neither swept, nor the seed, nor of a preset that is swept",
            )
        changes = {key: value for key, (_, value) in keys.items()}
        changes |= {"world.seed": 0, "world.mode": "lockstep"}
        config = build(_over(_over(given[name], variant.keys), changes))
        configs[Group(name, variant.name, tuple(label for label, _ in points))] = config
    _check_names(configs)
    _check_worlds(configs)
    for config in configs.values():
        check_controller(config)
    return CampaignPlan(files, variants, sweeps, seeds, baseline, configs)


def with_seed(config: Config, seed: int) -> Config:
    """The configuration of one trial of a group."""
    return replace(config, world=replace(config.world, seed=seed))


def _check_worlds(configs: Mapping[Group, Config]) -> None:
    """Errors that are better known before anything is collected and fitted."""
    for group, config in configs.items():
        if not config.team.one_world:
            raise ConfigError(
                f"{group.scenario}: team.plant, team.plant_per_robot",
                f"{config.team.plant!r}, {str(config.team.plant_per_robot).lower()}",
                "'mujoco', false",
                "trials are walked in one simulated world",
            )
    for config in {(c.team, c.world): c for c in configs.values()}.values():
        World(config)


def _check_sweeps(sweeps: Sequence[Sweep]) -> None:
    if len({sweep.key for sweep in sweeps}) < len(sweeps):
        raise ConfigError("--sweep", "a key twice", "different keys")
    for sweep in sweeps:
        if sweep.key in _OURS:
            raise ConfigError(
                f"--sweep {sweep.key}",
                "a key that a campaign sets itself",
                "another key",
                "--seeds chooses the seeds",
            )
        values = [value for _, value in sweep.values]
        if any(value in values[:place] for place, value in enumerate(values)):
            raise ConfigError(f"--sweep {sweep.key}", "a value twice", "different values")


def _check_names(configs: Mapping[Group, Config]) -> None:
    """Files and recordings of groups are told apart by their names."""
    by_name: dict[str, Group] = {}
    for group in configs:
        other = by_name.setdefault(group.name, group)
        if other != group:
            raise ConfigError(
                "variants and swept values",
                f"{other} and {group}",
                "names that differ in more than punctuation",
            )


def _files(names: Sequence[str]) -> dict[str, Path]:
    files: dict[str, Path] = {}
    for given in dict.fromkeys(names):
        file = scenarios.path(given)
        if file.stem in files:
            raise ConfigError("scenarios", f"{file.stem} twice", "files of different names")
        files[file.stem] = file
    return files


def _over(given: dict[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    return overlay(deepcopy(given), keys)


def _keys_of_presets(swept: Iterable[str]) -> set[str]:
    """Keys that a swept preset would take back from a variant."""
    sections = [section for section in PRESETS if f"{section}.preset" in swept]
    return {f"{section}.{key}" for section in sections for key in preset_keys(section)}
