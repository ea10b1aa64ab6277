"""The table of what can be made to go wrong in a team that walks in the simulated world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from quadriga.faults.clock_faults import CLOCK_FAULTS
from quadriga.faults.component_faults import COMPONENT_FAULTS
from quadriga.faults.fault import TeamFault
from quadriga.faults.given import find_given_fault
from quadriga.faults.link_faults import LINK_FAULTS, LINK_WORDS, LINKS
from quadriga.faults.load_faults import LOAD_FAULTS
from quadriga.faults.process_faults import PROCESS_FAULTS
from quadriga.faults.world_faults import WORLD_FAULTS
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.tables import Table

ALL: Final = "all"
FAULTS: Final = (
    *PROCESS_FAULTS,
    *WORLD_FAULTS,
    *LOAD_FAULTS,
    *CLOCK_FAULTS,
    *COMPONENT_FAULTS,
    *LINK_FAULTS,
)
"""In the order of the table."""
BY_NAME: Final = {fault.name: fault for fault in FAULTS}


def build_meaning_tables() -> tuple[Table, Table]:
    """What each fault is, and which words a link fails in beside its names in the table."""
    words = tuple(
        (word, *(f"{part}-{kind}" for part in LINKS), BY_NAME[f"link-{kind}"].what)
        for word, kind in LINK_WORDS.items()
    )
    return (
        Table("What the faults are", ("fault", "what"), tuple((f.name, f.what) for f in FAULTS)),
        Table(
            "Words for links",
            ("word", *(f"ROBOT/{part}" for part in LINKS), "what"),
            words,
            ["Sensors and motors fail in these words, too; no link can be stuck or wrong."],
        ),
    )


def find_fault(name: str, config: Config) -> TeamFault:
    """A fault by its name, or one with its time by a text, see `find_given_fault`.

    Raises:
        ConfigError: there is no such fault.
    """
    if " " in name:
        return find_given_fault(name, config, BY_NAME)
    if name not in BY_NAME:
        hint = did_you_mean(name, (ALL, *BY_NAME)) or "`quadriga fault --list` lists them"
        raise ConfigError("fault", repr(name), "the name of a fault, or all", hint)
    return BY_NAME[name]


def select_faults(names: Sequence[str], config: Config) -> list[TeamFault]:
    """Faults by their names, or all, in the order of the table.

    Raises:
        ConfigError: there is no such fault.
    """
    found = [find_fault(name, config) for name in dict.fromkeys(names) if name != ALL]
    own = [fault for fault in FAULTS if ALL in names or fault in found]
    return [*own, *(fault for fault in found if fault.given is not None)]
