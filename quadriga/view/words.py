"""What a picture says in words and figures, as HTML of the side panel; every text is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

import numpy as np

from quadriga.charts.colours import LINES, PALETTE
from quadriga.shared.messages import Reference
from quadriga.shared.robots.colours import robot_colour
from quadriga.view.picture import Picture, RobotAccount
from quadriga.view.team_shape import TeamShape
from quadriga.view.traffic import KeyTraffic

_CALM: Final = ("walk", "stand")
_QUIET_S: Final = 1.0  # a key that was silent for longer is shown pale
_TABLE: Final = "width:100%;border-collapse:collapse;font-size:0.78em;line-height:1.5"
_CELL: Final = "padding:0 0.5em 0 0;text-align:left;vertical-align:top"
_NUMBER: Final = "padding:0 0 0 0.5em;text-align:right;font-variant-numeric:tabular-nums"
_NONE: Final = "–"


def format_heading(
    shape: TeamShape, picture: Picture, reference: Reference | None, state: str
) -> str:
    """Whose picture it is, of when, whether it is true, and what is asked of the team."""
    team, robot = shape.config.team.name, shape.config.robot.title
    source = "the simulator's truth" if picture.is_truth else "an estimate, by dead reckoning"
    colour = PALETTE["green"] if picture.is_truth else PALETTE["orange"]
    badge = f"<b style='color:{colour}'>{source}</b>"
    lines = (
        f"<b>{escape(team)}</b>, {shape.count} × {escape(robot)} · {escape(state)}",
        f"<b>{picture.tick / 1000:.2f} s</b> · places: {badge}",
        f"asked: {_format_reference(reference)}",
    )
    return _block("<br>".join(lines))


def _format_reference(reference: Reference | None) -> str:
    if reference is None:
        return "nothing yet"
    turn = f"{np.degrees(reference.wz):.0f} °/s"
    ahead, left = f"{reference.vx:.2f} m/s ahead", f"{reference.vy:.2f} m/s left"
    return f"{ahead}, {left}, {turn}, {reference.height:.2f} m high"


def format_robots(
    robots: Sequence[str], accounts: Sequence[RobotAccount], known: Sequence[bool]
) -> str:
    """A row for each robot: mode, plan, ages of the peers' plans in it, planner's time."""
    heads = ("robot", "mode", "plan", "peers' plans", "planner")
    rows = [
        (f"{_dot(i)}{escape(name)}", *_cells_of(account, known=heard))
        for i, (name, account, heard) in enumerate(zip(robots, accounts, known, strict=True))
    ]
    return _block(_table(heads, rows, numbers=()))


def _cells_of(account: RobotAccount, *, known: bool) -> tuple[str, str, str, str]:
    mode = escape(account.mode) or ("no status yet" if known else "not heard yet")
    if account.mode and account.mode not in _CALM:
        mode = f"<b style='color:{PALETTE['bad']}'>{mode}</b>"
    if account.reason:
        mode += f"<br>{escape(account.reason)}"
    plan = escape(account.plan) or _NONE
    if account.plan_age_ms is not None:
        plan += f"<br>begun {account.plan_age_ms} ms ago"
    ages = account.peer_ages_ms or {}
    peers = "<br>".join(f"{escape(peer)} {age} ms" for peer, age in ages.items()) or _NONE
    planner = _NONE if account.planner_ms is None else f"{account.planner_ms:.1f} ms"
    return mode, plan, peers, planner


def format_traffic(rows: Iterable[KeyTraffic]) -> str:
    """A row for each key."""
    heads = ("key", "per s", "behind", "silent")
    cells = []
    for row in rows:
        behind = _NONE if row.behind_ms is None else f"{row.behind_ms} ms"
        silent = _NONE if row.silent_s is None else f"{row.silent_s:.1f} s"
        pale = row.silent_s is None or row.silent_s > _QUIET_S
        key = f"<span style='opacity:{0.5 if pale else 1}'>{escape(row.key)}</span>"
        cells.append((key, f"{row.per_s:.0f}", behind, silent))
    return _block(_table(heads, cells, numbers=(1, 2, 3)))


def format_happenings(happenings: Sequence[tuple[int, str]]) -> str:
    """What happened, the newest first, by tick and text."""
    if not happenings:
        return _block("nothing yet")
    rows = [(f"{tick / 1000:.2f} s", escape(text)) for tick, text in reversed(happenings)]
    return _block(_table(("", ""), rows, numbers=()))


def format_legend() -> str:
    """Which arrows are what."""
    true, planned = (_dot_of(LINES[style]["color"]) for style in ("true", "planned"))
    return _block(f"ground forces: {true}true {planned}planned; feet in contact are coloured")


def _dot(index: int) -> str:
    return _dot_of(robot_colour(index))


def _dot_of(colour: str) -> str:
    return f"<span style='color:{colour};font-size:1.3em;line-height:0'>&#9679;</span>&thinsp;"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int]) -> str:
    """A table; `rows` are HTML, `heads` text, and `numbers` the columns that hold numbers."""

    def style(column: int) -> str:
        return _NUMBER if column in numbers else _CELL

    head = "".join(f"<th style='{style(k)}'>{escape(text)}</th>" for k, text in enumerate(heads))
    body = "".join(
        "<tr>"
        + "".join(f"<td style='{style(k)}'>{cell}</td>" for k, cell in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return f"<table style='{_TABLE}'><tr>{head}</tr>{body}</table>"


def _block(html: str) -> str:
    return f"<div style='padding:0 0.8em;font-size:0.9em'>{html}</div>"
