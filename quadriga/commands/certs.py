"""`quadriga certs`: the certificates by which the processes of a team know each other."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

from quadriga.commands.command import AddCommand, Given, say
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError

if TYPE_CHECKING:
    from datetime import datetime

    from quadriga.certs.folder import CertificateFolder

_DAYS: Final = 30.0  # nobody can take a certificate back
_LONGEST: Final = 3650.0  # days, as long as the authority itself is valid


def add(add_command: AddCommand) -> None:
    command = add_command("certs", run, "make, renew and show a team's certificates")
    command.add_argument("action", choices=("make", "renew", "show"))
    command.add_argument("names", nargs="*", metavar="NAME", help="renew: whose (all)")
    command.add_argument(
        "--router",
        dest="hosts",
        action="append",
        default=[],
        metavar="HOST",
        help="make, renew: a name or an address by which others reach the router; may be repeated",
    )
    command.add_argument(
        "--days",
        type=float,
        default=_DAYS,
        metavar="D",
        help=f"make, renew: how long they are valid ({_DAYS:g})",
    )


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Do one of the three in the folder `bus.certificates`."""
    from quadriga.certs.folder import CertificateFolder
    from quadriga.shared.runtime.clock import utc_now

    action, names = arguments.action, arguments.names
    if not 0.0 < arguments.days <= _LONGEST:
        raise ConfigError("--days", f"{arguments.days:g}", f"above 0 and at most {_LONGEST:g}")
    if names and action != "renew":
        raise ConfigError("NAME", " ".join(names), f"none with {action!r}")
    folder, now = CertificateFolder.of_team(config), utc_now()
    if action == "make":
        made = folder.make(config.team.name, arguments.hosts, now, arguments.days)
        say(f"{', '.join(made) or 'nobody'} got a certificate in {folder.path}")
    elif action == "renew":
        made = folder.renew(names, arguments.hosts, now, arguments.days)
        say(f"new: {', '.join(made)}; copy their folders to their machines")
    _show(folder, now)
    return 0


def _show(folder: CertificateFolder, now: datetime) -> None:
    """Print who has which certificate, and for how long."""
    from quadriga.tables import align_columns

    rows = [("identity", "days left", "state")]
    standings = folder.standings()
    if not standings:
        cause = "`quadriga certs make` makes it"
        raise ConfigError(str(folder.path), "no certificate", "the certificates of a team", cause)
    for standing in standings:
        days = f"{standing.certificate.days_left(now):.0f}"
        rows.append((standing.identity, days, standing.state(now)))
    print("\n".join(align_columns(rows, right=(1,), indent="")))
