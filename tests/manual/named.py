"""Whether what a command names is there: scenarios, experiments, faults, predictors, files."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping
from importlib.metadata import metadata
from typing import Final

from quadriga.commands import fault
from quadriga.experiments.published.catalogue import list_names
from quadriga.experiments.variants import combine_with_predictors, parse_variants
from quadriga.faults.catalogue import ALL, select_faults
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.places import SOURCE
from quadriga.sim_server.world.faults import build_components, parse_faults, with_time
from quadriga.team import scenarios

# Folders of the checkout that pages name files of.
_FOLDERS: Final = "agents|benchmarks|bridges|deploy|docs|plant|quadriga|shared|sim_server|tests"
_PLACE: Final = re.compile(rf"(?:^|(?<=[\s=,:;'\"]))(?:{_FOLDERS})/[\w./@-]+|[\w-]+\.lock\b")
_EXTRA: Final = re.compile(r"\.\[(\w+)\]")
_BUILT: Final = "docs/_build"  # by `make docs`


def is_place(text: str) -> bool:
    """Whether a text is the name of a file or folder of the checkout, without a part left open."""
    return _PLACE.fullmatch(text) is not None and "/NAME" not in text


def check_places(text: str) -> None:
    """See that the files of the checkout and the extras of the package that a text names are there.

    Raises:
        AssertionError: one is not.
    """
    for place in _PLACE.findall(text):
        found = (SOURCE / place).exists() or place.startswith(_BUILT)
        assert found, f"no file {place} in the checkout"
    for extra in _EXTRA.findall(text):
        assert extra in (metadata("quadriga").get_all("Provides-Extra") or ()), f"no extra {extra}"


def check_named(arguments: argparse.Namespace, config: Config) -> None:
    """See that what a command names is there, as the command itself does before it begins.

    Raises:
        ConfigError: something is not, or does not go together with the configuration.
    """
    robots = getattr(arguments, "robot", None) or ()
    for robot in [robots] if isinstance(robots, str) else robots:
        if robot not in (names := robot_names(config.team.robots)):
            raise ConfigError("--robot", repr(robot), f"one of {', '.join(names)}")
    if arguments.command in _CHECKS:
        _CHECKS[arguments.command](arguments, config)


def _check_campaign(arguments: argparse.Namespace, _config: Config) -> None:
    names = _split(arguments.predictors)
    variants = parse_variants(arguments.planners or ["none,distributed"], arguments.variants)
    for variant in combine_with_predictors(variants, names):
        load(None, {**variant.keys, "identification.response": ""})
    for name in arguments.scenarios:
        scenarios.path(name)


def _check_experiments(arguments: argparse.Namespace, _config: Config) -> None:
    for name in arguments.names:
        if not name.endswith(".toml") and name not in list_names():
            raise ConfigError("experiments", repr(name), f"one of {', '.join(list_names())}")


def _check_fault(arguments: argparse.Namespace, config: Config) -> None:
    if arguments.live:
        text = " ".join([*arguments.names, *([str(arguments.span)] if arguments.span else [])])
        components = tuple(build_components(config.robot))
        parse_faults(with_time(text, 0), robot_names(config.team.robots), components)
    elif not arguments.list:
        select_faults([ALL] if arguments.table else fault._names_of(arguments), config)


def _split(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


_CHECKS: Final[Mapping[str, Callable[[argparse.Namespace, Config], None]]] = {
    "campaign": _check_campaign,
    "experiments": _check_experiments,
    "fault": _check_fault,
}
