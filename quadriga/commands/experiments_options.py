"""Options of `quadriga experiments`."""

from __future__ import annotations

from pathlib import Path

from quadriga.commands import experiments as verb
from quadriga.commands.campaign_options import add_where
from quadriga.commands.command import AddCommand


def add_experiments(add: AddCommand) -> None:
    """The command itself."""
    command = add(
        "experiments",
        verb.experiments,
        "walk what README and docs tell results of, and publish them",
    )
    command.epilog = (
        "The same command goes on where it ended. Exit status 0 says that results are published, "
        "whether or not they meet what is required."
    )
    option = command.add_argument
    option("names", nargs="*", metavar="NAME", help="of deploy/experiments, or a TOML file (all)")
    option(
        "--only-publish",
        action="store_true",
        help="walk nothing: draw tables and figures from the runs there are, or from what is "
        "published",
    )
    option(
        "--seeds", metavar="LIST", help="a quick look at these instead, 0:2: shown, not published"
    )
    option(
        "--from-published",
        action="store_true",
        help="go on from the published trials, if they are of this code, these libraries and "
        "the same predictors, instead of walking anew what --out does not hold",
    )
    add_where(command)
    option(
        "--out",
        type=Path,
        default=Path("runs/experiments"),
        metavar="DIR",
        help="where campaigns are kept, to go on with (%(default)s)",
    )
    option(
        "--into",
        type=Path,
        metavar="DIR",
        help="the checkout whose README.md and docs/ are written (this code's)",
    )
