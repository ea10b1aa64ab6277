"""What a campaign consists of, as its folder says: enough to go on with it, and to report on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final, TypeVar

from quadriga.experiments.plan import Group
from quadriga.experiments.trial.origin import is_same_code
from quadriga.shared.errors import ConfigError

_T = TypeVar("_T", "GroupEntry", "SweepEntry", "Manifest")

FILE: Final = "campaign.json"
FORMAT: Final = 1
_SHOWN: Final = 80  # characters of a value that is wrong
_REMEDY: Final = "trials of both must not be mixed: use a new folder"
# By the annotation of a field whether a value read from a file is of it.
_FITS: Final[Mapping[str, Callable[[Any], bool]]] = {
    "str": lambda value: isinstance(value, str),
    "float | None": lambda value: value is None or type(value) in (int, float),
    "tuple[str, ...]": lambda value: all(isinstance(each, str) for each in value),
    "tuple[int, ...]": lambda value: all(type(each) is int and each >= 0 for each in value),
}
_UNKNOWN: Final = (
    "this machine's last digits are others (arithmetic) and the sources have changed, so that "
    "nobody can tell whether the code does the same: use a new folder"
)


@dataclass(frozen=True, slots=True)
class GroupEntry:
    """A group: its names, seeds, and digests.

    `config_sha256` is that of its configuration with seed 0, and of the trace that this names;
    `plugin` names the package that its planner comes with, or the controller of one's own that
    walks, with the digest of its files (`foreign_origin`), and is empty where all is the project's;
    `radius` is that of the iteration of the agents' plans, None where they do not use their peers'
    or where nobody has noted it.
    """

    scenario: str
    variant: str
    swept: tuple[str, ...]
    config_sha256: str
    predictor_sha256: str
    seeds: tuple[int, ...]
    plugin: str = ""
    radius: float | None = None

    @property
    def group(self) -> Group:
        """Its names."""
        return Group(self.scenario, self.variant, self.swept)


@dataclass(frozen=True, slots=True)
class SweepEntry:
    """A swept key, and what a figure calls it."""

    key: str
    name: str


@dataclass(frozen=True, slots=True)
class Manifest:
    """A campaign.

    Attributes:
        typed: commands that walked it, oldest first.
        baseline: the variant that others are compared with.
        variants: keys of each variant, by name.
        sweeps: swept keys.
        groups: everything that is to be walked.
        versions: of code and libraries; trials of others are not mixed with these.
    """

    typed: tuple[str, ...]
    baseline: str
    variants: Mapping[str, Mapping[str, Any]]
    sweeps: tuple[SweepEntry, ...]
    groups: tuple[GroupEntry, ...]
    versions: str
    format: int = FORMAT

    @classmethod
    def from_dict(cls, body: Mapping[str, Any]) -> Manifest:
        """The inverse of `asdict`, after JSON.

        Raises:
            ValueError, KeyError, TypeError: it is something else.
        """
        if body["format"] != FORMAT:
            raise ValueError(f"format {body['format']} instead of {FORMAT}")
        groups = tuple(
            _checked(GroupEntry(**{**g, "swept": tuple(g["swept"]), "seeds": tuple(g["seeds"])}))
            for g in body["groups"]
        )
        sweeps = tuple(_checked(SweepEntry(**sweep)) for sweep in body["sweeps"])
        variants = {variant: dict(keys) for variant, keys in dict(body["variants"]).items()}
        read = {"groups": groups, "sweeps": sweeps, "variants": variants}
        return _checked(cls(**{**body, "typed": tuple(body["typed"]), **read}))

    @property
    def trials(self) -> int:
        """Trials to be walked in all."""
        return sum(len(entry.seeds) for entry in self.groups)

    def check_versions(self, versions: str, folder: Path) -> None:
        """Refuse to go on with other code or libraries.

        Raises:
            ConfigError: they are not those that the folder's trials were walked with, or nobody
                can tell.
        """
        same = is_same_code(versions, self.versions)
        if not same:
            raise ConfigError(
                f"--out {folder}",
                f"trials with code and versions {self.versions}",
                versions,
                _UNKNOWN if same is None else _REMEDY,
            )

    def merge(self, more: Manifest, folder: Path) -> Manifest:
        """This manifest with the trials of another one added.

        Raises:
            ConfigError: trials of the two would not belong together.
        """
        name = f"--out {folder}"
        self.check_versions(more.versions, folder)
        mine, theirs = ([sweep.name for sweep in one.sweeps] for one in (self, more))
        if mine != theirs:
            raise ConfigError(name, f"trials with swept keys {mine}", f"{theirs}", _REMEDY)
        groups = {entry.group: entry for entry in self.groups}
        for entry in more.groups:
            known = groups.setdefault(entry.group, entry)
            for what, old, new in (
                ("configuration", known.config_sha256[:12], entry.config_sha256[:12]),
                ("predictor", known.predictor_sha256[:12], entry.predictor_sha256[:12]),
                ("planner or controller", known.plugin, entry.plugin),
            ):
                if old != new:
                    raise ConfigError(
                        f"{name}: {entry.group.name}",
                        f"trials of {what} {old}",
                        f"of {new}",
                        _REMEDY,
                    )
            groups[entry.group] = replace(
                known,
                seeds=tuple(sorted({*known.seeds, *entry.seeds})),
                radius=entry.radius if known.radius is None else known.radius,
            )
        return replace(
            more,
            typed=(*self.typed, *(t for t in more.typed if t not in self.typed)),
            variants={**self.variants, **more.variants},
            groups=tuple(groups.values()),
            versions=self.versions,  # of the same code by another name, perhaps
        )


def _checked(entry: _T) -> _T:
    """An entry, whose fields are of the types that they should be.

    Raises:
        ValueError: one is not; it is named.
    """
    for item in fields(entry):
        fits, value = _FITS.get(str(item.type)), getattr(entry, item.name)
        if fits is not None and not fits(value):
            raise ValueError(f"{item.name} {value!r}"[:_SHOWN])
    return entry
