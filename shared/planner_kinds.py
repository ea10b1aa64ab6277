"""The kinds of planner: what everyone asks about `planner.kind`, and who builds it.

A kind is one of `BUILT_IN`, or comes with another package: an entry point of the group
`quadriga.planners`, named as the kind, leads to its `PlannerKind`. Builders are named as text, so
that whoever only reads a configuration imports no planner.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.shared.runtime.installed import digest_files

GROUP: Final = "quadriga.planners"
NO_PLANNER: Final = "none"  # the kind without plans
# What agents do of every kind that is one process for the team: they follow its plans.
FOLLOW: Final = "quadriga.agents.planning.remote:RemotePlanning"
_LOCAL: Final = "quadriga.agents.planning.local:LocalPlanning"
_CENTRAL: Final = "quadriga.agents.planner.team"
_KEY: Final = "planner.kind"


@dataclass(frozen=True, slots=True, eq=False)
class PlannerKind:
    """One kind of planner.

    Attributes:
        name: value of `planner.kind`.
        title: what it does, in a few words.
        build: "module:function" that builds an agent's planning part, a `PlanningInterface`, from
            the configuration, the agent's place in the team, the predictor or None, a clock, and,
            of a kind that needs data, a function that reads the collected episodes.
        build_team: "module:function" that builds the `TeamPlanner` of a kind that is one process
            for the whole team, from the configuration, the predictor or None, and a function that
            reads the collected episodes; "" for all other kinds.
        needs_predictor: whether it plans with a fitted predictor, which then has to pass the gates.
        needs_peers: whether agents, which plan for themselves, respond to their peers' plans. Then
            the best-response gate applies, and the check of the delay holds every plan against the
            peers' plans.
        needs_data: whether it plans with the collected data themselves.
        publishes: whether plans are published; if so they are missed where there are none.
        options: numbers that `planner.options` may set, with their defaults.
    """

    name: str
    title: str
    build: str
    build_team: str = ""
    needs_predictor: bool = True
    needs_peers: bool = False
    needs_data: bool = False
    publishes: bool = True
    options: Mapping[str, float] = field(default_factory=dict)

    @property
    def central(self) -> bool:
        """Whether one process plans for the whole team."""
        return bool(self.build_team)

    @property
    def agents_predict(self) -> bool:
        """Whether each agent plans with a predictor of its own."""
        return self.needs_predictor and not self.central


BUILT_IN: Final[Mapping[str, PlannerKind]] = {
    kind.name: kind
    for kind in (
        PlannerKind(
            "distributed",
            "each agent plans with its peers' last plans (eq. 12)",
            _LOCAL,
            needs_peers=True,
        ),
        PlannerKind("decentralised", "without its peers", _LOCAL),
        PlannerKind(
            "centralised",
            "one process plans for all (eq. 7)",
            FOLLOW,
            f"{_CENTRAL}:build_centralised",
        ),
        PlannerKind(
            "deepc",
            "one process plans for all (eq. 5)",
            FOLLOW,
            f"{_CENTRAL}:build_deepc",
            needs_data=True,
        ),
        PlannerKind(
            NO_PLANNER,
            "nominal forces",
            "quadriga.agents.planning.registry:NominalPlanning",
            needs_predictor=False,
            publishes=False,
        ),
    )
}


def find_kind(name: str) -> PlannerKind:
    """The kind of planner of this name.

    Raises:
        ConfigError: no installed package has such a kind, or two have; or it cannot be imported.
    """
    return BUILT_IN.get(name) or _find_plugin(name)


def installed_kinds() -> tuple[str, ...]:
    """Names of all kinds: the built-in ones, then those of plug-ins, which are not imported."""
    plugins = {entry.name for entry in entry_points(group=GROUP)} - BUILT_IN.keys()
    return (*BUILT_IN, *sorted(plugins))


def load_builder(kind: PlannerKind, reference: str) -> Any:
    """What a kind's `build` or `build_team` names.

    Raises:
        ConfigError: there is no such module or function, or it cannot be imported.
    """
    module, _, name = reference.partition(":")
    try:
        return getattr(import_module(module), name)
    except Exception as error:
        raise _import_error(kind.name, reference, error) from error


def read_options(kind: PlannerKind, text: str) -> dict[str, float]:
    """The options of a kind: its defaults, and what the text of `planner.options` says instead.

    The text has pairs name=number, separated by spaces.

    Raises:
        ConfigError: an option that the kind does not have, one twice, or no finite number.
    """
    given: dict[str, float] = {}
    for part in text.split():
        name, _, number = part.partition("=")
        if name not in kind.options:
            known = f"options of {kind.name}: {', '.join(kind.options) or 'it has none'}"
            hint = did_you_mean(name, kind.options)
            raise ConfigError("planner.options", repr(part), known, hint)
        if name in given:
            raise ConfigError("planner.options", f"{name} twice", "each option once")
        given[name] = math.nan
        with suppress(ValueError):
            given[name] = float(number)
        if not math.isfinite(given[name]):
            raise ConfigError("planner.options", repr(part), f"{name}=NUMBER, a finite one")
    return {**kind.options, **given}


def plugin_origin(name: str) -> str:
    """Distribution, version and digest of the files of a plug-in's kind; "" for a built-in one.

    The digest has 16 hexadecimal digits and is that of every file of the packages that the kind
    and its builders lie in: other code has another one, whatever its version says.

    Raises:
        ConfigError: as `find_kind`.
    """
    if name in BUILT_IN:
        return ""
    kind, entry = find_kind(name), _find_entry(name)
    references = filter(None, (entry.value, kind.build, kind.build_team))
    tops = {reference.partition(":")[0].partition(".")[0] for reference in references}
    files = (file for top in sorted(tops - {"quadriga"}) for file in _files_of(top))
    return f"{_distribution_of(entry)} {digest_files(files)}"


@cache
def _find_plugin(name: str) -> PlannerKind:
    entry = _find_entry(name)
    try:
        kind = entry.load()
    except Exception as error:
        raise _import_error(name, entry.value, error) from error
    if not isinstance(kind, PlannerKind) or kind.name != name:
        got = f"{entry.value} of {_distribution_of(entry)}: {kind!r:.80}"
        raise ConfigError(_KEY, got, f"a PlannerKind named {name!r}")
    return kind


def _find_entry(name: str) -> EntryPoint:
    """The one entry point of this name."""
    entries: list[EntryPoint] = [*entry_points(group=GROUP, name=name)]
    if not entries:
        known = installed_kinds()
        install = f"install the package that has it: an entry point {name!r} of the group {GROUP}"
        hint = did_you_mean(name, known) or install
        raise ConfigError(_KEY, repr(name), f"one of {', '.join(known)}", hint)
    owners = sorted({_distribution_of(entry) for entry in entries})
    if len(owners) > 1:
        got = f"{name!r} of {' and of '.join(owners)}"
        raise ConfigError(_KEY, got, "one package that has it", "uninstall the other")
    return entries[0]


def _distribution_of(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unnamed distribution"


def _import_error(name: str, reference: str, error: Exception) -> ConfigError:
    owner = "quadriga" if name in BUILT_IN else _distribution_of(_find_entry(name))
    got = f"{name!r}, whose {reference} of {owner} raises {type(error).__name__}: {error}"
    cause = "reinstall the package with what it needs, or choose another kind"
    return ConfigError(_KEY, got, "a planner that can be imported", cause)


def _files_of(top: str) -> list[tuple[str, Path]]:
    """Every file of a top-level package or module by its path within it, in a fixed order."""
    spec = find_spec(top)
    if spec is None:
        return []
    if spec.submodule_search_locations is None:
        return [("", Path(str(spec.origin)))]
    return [
        (path.relative_to(folder).as_posix(), path)
        for folder in map(Path, spec.submodule_search_locations)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    ]
