"""The roll of a team: who may have a certificate, and the name that stands in it.

A certificate's common name is `<identity>.<n>`, where n counts those that its identity was given.
Zenoh compares common names letter by letter, so the rules list them: those that may be given
next too, so that a router need not start again when a certificate is renewed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.members import (
    DOCTOR,
    ESTOP,
    LAUNCHER,
    OBSERVER,
    RESET,
    RESUME,
    ROLES,
    ROUTER,
    STOP,
    team_members,
)
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.wire.topics import TABLE

REVOKED: Final = "revoked.json"  # in the router's folder: by identity the last number revoked
# Certificates of one identity that are valid at a time; more are given only after a revocation.
MOST_VALID: Final = 32
_DIGITS: Final = 15  # of a certificate's number
_OTHERS: Final = (LAUNCHER, ESTOP, STOP, RESET, RESUME, DOCTOR, OBSERVER, ROUTER)
_LOOKS_ON: Final = re.compile(r".+-\d+")  # such as echo-4711


@dataclass(frozen=True, slots=True)
class Identity:
    """Who a certificate is for.

    Attributes:
        name: that of the process on the bus; `observer` of all who only look on.
        role: the name of a row of the table of processes, or as `name`.
        robot: whose process it is; "" of one that is for all.
    """

    name: str
    role: str
    robot: str = ""


def team_roll(config: Config) -> tuple[Identity, ...]:
    """Everybody who may be on a team's bus, whatever it records and however it plans."""
    members = team_members(
        robot_names(config.team.robots),
        central=True,
        recorded=True,
        plant_each=config.team.plants == "each",
    )
    foreign = {name for topic in TABLE for name in (*topic.senders, *topic.receivers)}
    foreign -= {*_OTHERS, *(role.name for role in ROLES)}
    return (
        *(Identity(member.name, member.role.name, member.robot) for member in members),
        *(Identity(name, name) for name in (*_OTHERS, *sorted(foreign))),
    )


def identity_of(process: str) -> str:
    """The identity of a process by its name on the bus; those who look on end in their number."""
    return OBSERVER if _LOOKS_ON.fullmatch(process) else process


def common_name(identity: str, number: int) -> str:
    """What stands in the certificate `number` (from 1) of an identity."""
    return f"{identity}.{number}"


def split_common_name(name: str) -> tuple[str, int]:
    """The identity and the number of a common name; the number is 0 if it is none of these."""
    identity, _, number = name.rpartition(".")
    known = identity and number.isdecimal() and len(number) <= _DIGITS
    return (identity, int(number)) if known else (name, 0)


def valid_names(identity: str, revoked: int) -> list[str]:
    """The common names of an identity that are valid, once those up to `revoked` are not."""
    return [common_name(identity, revoked + k) for k in range(1, MOST_VALID + 1)]


def read_numbers(text: str, name: str) -> dict[str, int]:
    """By identity the number of a certificate, from the text of the file `name`.

    Raises:
        ConfigError: it is not that.
    """
    try:
        given: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _wrong(name, str(error)) from None
    if not isinstance(given, dict):
        raise _wrong(name, type(given).__name__)
    for identity, number in given.items():
        if type(number) is not int or number < 0:
            raise _wrong(name, f"{identity}: {number!r}"[:80])
    return given


def format_numbers(numbers: Mapping[str, int]) -> str:
    """The text that `read_numbers` reads."""
    return json.dumps(dict(sorted(numbers.items())), indent=1) + "\n"


def _wrong(name: str, got: str) -> ConfigError:
    return ConfigError(
        name, got, "numbers of certificates by identity", "`quadriga certs` writes them"
    )
