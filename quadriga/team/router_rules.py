"""What a router lets through, if those who connect show certificates."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.members import ROUTER
from quadriga.shared.security.access import access_control
from quadriga.shared.security.caps import capacity
from quadriga.shared.security.roll import REVOKED, read_numbers
from quadriga.shared.security.tls import identity_folder


def router_rules(config: Config) -> dict[str, Any]:
    """Zenoh's settings: who may send and hear what, how much, how often.

    Raises:
        ConfigError: the list of revoked certificates is missing or damaged.
    """
    return {"access_control": access_control(config, revoked_numbers(config)), **capacity(config)}


def revoked_numbers(config: Config) -> Mapping[str, int]:
    """By identity the number of the last certificate that is not valid any more.

    Raises:
        ConfigError: the list is missing or damaged.
    """
    path = identity_folder(Path(config.bus.certificates), ROUTER) / REVOKED
    cause = "`quadriga certs make` makes it; copy the folder router to this machine"
    with name_file_errors(ConfigError, path, "numbers of revoked certificates", cause):
        text = path.read_text(encoding="utf-8")
    return read_numbers(text, str(path))
