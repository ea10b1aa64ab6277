"""With which code and libraries a trial is walked, and whether two such are the same.

`code` is what the code does (`quadriga.identification.behaviour`), `sources` its text, and
`arithmetic` what the last bits of a sum depend on besides. Other arithmetic gives other digits, and
so another `code`, whatever the code: then only equal sources tell that it is the same.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import version
from typing import Final

from quadriga.agents.predictor.store import versions
from quadriga.identification.behaviour import behaviour, sources_digest
from quadriga.shared.agent_command import command_origin
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import plugin_origin
from quadriga.shared.runtime.arithmetic import arithmetic_digest

CODE: Final = "code"
SOURCES: Final = "sources"
ARITHMETIC: Final = "arithmetic"
_SAMPLES: Final = "quadriga.experiments.trial.sample_trials"


def foreign_origin(config: Config) -> str:
    """What of a team is not this project's code: a controller of one's own, or a planner's package.

    It names either with a digest of its files, and is empty if there is neither.

    Raises:
        ConfigError: it cannot be found, or not be read.
    """
    return command_origin(config.team.agent_command) or plugin_origin(config.planner.kind)


@lru_cache(maxsize=1)
def code_and_libraries() -> str:
    """Code and libraries of this process, as every row names them."""
    found = {
        **versions(),
        **{name: version(name) for name in ("numba", "example-robot-data")},
        CODE: behaviour(_SAMPLES),
        SOURCES: sources_digest(_SAMPLES),
        ARITHMETIC: arithmetic_digest(),
    }
    return ", ".join(f"{name} {value}" for name, value in found.items())


def is_same_code(one: str, other: str) -> bool | None:
    """Whether two of these name the same code and libraries; None if that cannot be told."""
    if one == other:
        return True
    mine, theirs = _parts(one), _parts(other)
    for name in (mine | theirs).keys() - {CODE, SOURCES, ARITHMETIC}:
        if mine.get(name) != theirs.get(name):
            return False
    if SOURCES in mine and mine[SOURCES] == theirs.get(SOURCES):
        return True
    if mine.get(ARITHMETIC) != theirs.get(ARITHMETIC):
        return None
    return mine.get(CODE) == theirs.get(CODE)


def _parts(text: str) -> dict[str, str]:
    pairs = (part.rpartition(" ") for part in text.split(", "))
    return {name: value for name, _, value in pairs}
