"""What the processes of a team must have in common, and in what one of them differs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from quadriga.shared.errors import BusError
from quadriga.shared.wire.about import About

VERSION: Final = "version"
CONFIGURATION: Final = "configuration"
MESSAGES: Final = "messages"
PREDICTOR: Final = "predictor"
CODE: Final = "code"
LIBRARIES: Final = "libraries"
# No team walks with these.
REFUSED: Final = frozenset({VERSION, MESSAGES, CONFIGURATION, PREDICTOR})

REMEDIES: Final[Mapping[str, str]] = {
    VERSION: "install the same version of quadriga on all computers",
    MESSAGES: "the versions are the same and the messages are not: install the same files",
    CONFIGURATION: "all processes of a team read the same file: copy it, give the same options",
    PREDICTOR: "copy the predictor's file and name it with --predictor, or fit both by the same "
    "code",
    CODE: "the versions are the same and the source files are not: update both",
    LIBRARIES: "the last digits of plans may differ; requirements.lock has the versions",
}
_SHOWN: Final = 3  # keys or libraries that are named
_DIGITS: Final = 12  # of a digest


@dataclass(frozen=True, slots=True)
class TeamNorm:
    """What all must agree with.

    Attributes:
        lead: what the process that drives the team's time says of itself.
        predictor: digest of the predictor of the first process that plans; "": unknown.
        planner: the name of that process.
    """

    lead: About
    predictor: str = ""
    planner: str = ""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """In what one process differs.

    Attributes:
        of: `VERSION`, `CONFIGURATION`, `PREDICTOR`, `CODE` or `LIBRARIES`.
        got: what it has.
        wanted: what it should have.
        owner: the process that has this.
    """

    of: str
    got: str
    wanted: str
    owner: str


def disagreements(process: About, norm: TeamNorm) -> tuple[Disagreement, ...]:
    """In what a process differs from the others; of another version nothing else is compared."""
    lead = norm.lead
    if process.version != lead.version:
        got, wanted = process.version or "not installed", lead.version or "not installed"
        return (Disagreement(VERSION, got, wanted, lead.name),)
    found = list[Disagreement]()
    own, its = _by_name(process.messages, " "), _by_name(lead.messages, " ")
    shared = own.keys() & its.keys()  # topics of a plug-in need not be known to all
    for what, mine, theirs in (
        (MESSAGES, {n: own[n] for n in shared}, {n: its[n] for n in shared}),
        (CONFIGURATION, _by_name(process.config, "="), _by_name(lead.config, "=")),
        (LIBRARIES, _by_name(process.libraries, " "), _by_name(lead.libraries, " ")),
    ):
        names = [name for name in sorted({*mine, *theirs}) if mine.get(name) != theirs.get(name)]
        if names:
            got, wanted = _name_values(names, mine), _name_values(names, theirs)
            found.append(Disagreement(what, got, wanted, lead.name))
    if process.predictor and norm.predictor and process.predictor != norm.predictor:
        got, wanted = process.predictor[:_DIGITS], norm.predictor[:_DIGITS]
        found.append(Disagreement(PREDICTOR, got, wanted, norm.planner))
    if process.code != lead.code:
        found.append(Disagreement(CODE, process.code, lead.code, lead.name))
    return tuple(sorted(found, key=lambda item: list(REMEDIES).index(item.of)))


def refuse(name: str, team: str, found: Iterable[Disagreement]) -> None:
    """Refuse a process that differs in what no team walks with.

    Args:
        name: the process.
        team: the team's name.
        found: in what it differs.

    Raises:
        BusError: it does; the message names what, for instance the keys of the configuration.
    """
    for item in found:
        if item.of in REFUSED:
            raise BusError(
                f"{item.of} of {name} in team {team!r}",
                item.got,
                f"{item.wanted} as {item.owner} has it",
                REMEDIES[item.of],
            )


def _by_name(lines: Iterable[str], separator: str) -> dict[str, str]:
    return dict(_split(lines, separator))


def _split(lines: Iterable[str], separator: str) -> Iterator[tuple[str, str]]:
    for line in lines:
        name, _, value = line.partition(separator)
        yield name, value


def _name_values(names: list[str], values: Mapping[str, str]) -> str:
    """Some of the values, with their names, and how many more there are."""
    named = [f"{name} {values.get(name, 'unknown')}" for name in names[:_SHOWN]]
    more = len(names) - len(named)
    return ", ".join(named) + (f" and {more} more" if more else "")
