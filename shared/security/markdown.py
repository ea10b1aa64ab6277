"""The rights of a team, as a table of docs/security.md."""

from __future__ import annotations

from typing import Final

from quadriga.shared.config.load import load
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.places import SOURCE
from quadriga.shared.security.access import Rights, team_rights

PAGE: Final = SOURCE / "docs" / "security.md"
_BEGIN: Final = "<!-- rights: made by python -m quadriga.shared.security.markdown -->\n"
_END: Final = "<!-- end of rights -->\n"
_EACH: Final = {"team.plant_per_robot": True, "world.mode": "realtime", "team.yokes": "none"}


def rights_table() -> str:
    """Who may send and hear what in a team of two, one row for each identity."""
    one, each = (load(None, {"team.robots": 2, **keys}) for keys in ({}, _EACH))
    known = {rights.identity.name for rights in team_rights(one)}
    rows = [*team_rights(one), *(r for r in team_rights(each) if r.identity.name not in known)]
    lines = ["| certificate of | may send | may hear |", "|---|---|---|"]
    return "".join(f"{line}\n" for line in (*lines, *(_row(rights) for rights in rows)))


def renewed(page: str) -> str:
    """The page with today's table."""
    before, begin, rest = page.partition(_BEGIN)
    _, end, after = rest.partition(_END)
    return before + begin + rights_table() + end + after


def _row(rights: Rights) -> str:
    cells = (f"`{rights.identity.name}`", *map(_keys, (rights.publishes, rights.hears)))
    return f"| {' | '.join(cells)} |"


def _keys(keys: tuple[str, ...]) -> str:
    return ", ".join(f"`{key.partition('/')[2]}`" for key in keys) or "nothing"


if __name__ == "__main__":
    write_text(PAGE, renewed(PAGE.read_text(encoding="utf-8")))
