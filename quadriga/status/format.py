"""A team's status as lines, as tables of a terminal, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any, Final

from quadriga.doctor.health import WELL
from quadriga.recordings.late_commands import overloaded
from quadriga.shared.printable import printable_line
from quadriga.shared.topics import TABLE
from quadriga.status.record import Account, Costs, MemberStatus, TeamStatus
from quadriga.tables import NOTHING, Table, align_columns, format_number

FORMAT: Final = 1  # of the JSON; a field that is added does not change it
_MEMBER_HEADS: Final = (
    *("process", "health", "mode", "plan [ms]", "tick [µs]"),
    *("inputs [ms]", "CPU", "memory [MB]"),
)
_TOPIC_HEADS: Final = ("key", "per world s", "per wall s", "lost")
_TOPICS: Final = frozenset(topic.name for topic in TABLE)  # other ages are none of an input


def format_head(status: TeamStatus) -> str:
    """Which team it is, where, and how far it has come."""
    at = status.reading
    time = f"{1e-3 * at.tick:.2f} s" if at.tick >= 0 else "has not begun"
    pace = f", {at.pace:.2f} × real time" if at.pace is not None else ""
    return printable_line(f"team {status.team!r} at {status.endpoint}: {time}{pace}")


def build_status_tables(status: TeamStatus) -> tuple[Table, Table]:
    """Of its processes, and of its topics."""
    topics = tuple(
        (
            of.key,
            format_number(of.per_world_s, ".1f"),
            format_number(of.per_wall_s, ".1f"),
            f"{of.lost:,}",
        )
        for of in status.reading.topics
    )
    members = tuple(_member_row(member) for member in status.members)
    return Table("", _MEMBER_HEADS, members), Table("", _TOPIC_HEADS, topics)


def format_rest(status: TeamStatus) -> Iterator[str]:
    """Late commands, what happened last, and what is wrong."""
    late = status.reading.late
    if late:
        shares = ", ".join(f"{robot} {share:.1%}" for robot, share in sorted(late.items()))
        much = " (too many)" if overloaded(late) else ""
        yield f"late commands: {shares}{much}"
    if status.reading.events:
        yield "what happened last:"
        yield from (f"  {event}" for event in status.reading.events)
    yield from (printable_line(f"wrong: {problem}") for problem in status.problems)


def format_status(status: TeamStatus) -> list[str]:
    """All of it, a line for each thing."""
    lines = [format_head(status)]
    for table in build_status_tables(status):
        if table.rows:
            right = range(1, len(table.columns)) if table.columns is _TOPIC_HEADS else ()
            lines += ["", *align_columns([table.columns, *table.rows], right=right)]
    rest = list(format_rest(status))
    return [*lines, *(["", *rest] if rest else [])]


def to_json(status: TeamStatus) -> str:
    """One JSON object in one line; docs/status.md lists its fields."""
    reading = status.reading
    body: dict[str, Any] = {
        "format": FORMAT,
        "well": status.is_well,
        "team": status.team,
        "endpoint": status.endpoint,
        "linked": status.linked,
        "tick": reading.tick,
        "pace": reading.pace,
        "members": [asdict(member) for member in status.members],
        "topics": [asdict(topic) for topic in reading.topics],
        "lost": dict(reading.lost),
        "late": dict(reading.late),
        "events": list(reading.events),
        "problems": list(status.problems),
    }
    return json.dumps(body, ensure_ascii=False)


def _member_row(member: MemberStatus) -> tuple[str, ...]:
    use, account = member.use, member.account
    cpu, memory = (None, None) if use is None else (use.cpu, use.memory)
    told = (NOTHING,) * 4 if account is None else _account_cells(account)
    return (
        member.name,
        member.health if member.here or member.health != WELL else "gone",
        *told,
        NOTHING if cpu is None else f"{cpu:.0%}",
        NOTHING if memory is None else f"{1e-6 * memory:.0f}",
    )


def _account_cells(account: Account) -> tuple[str, str, str, str]:
    oldest: dict[str, float] = {}
    for name, age in account.ages_ms.items():
        topic = name.partition(".")[0]  # the rest names a peer
        if topic in _TOPICS:
            oldest[topic] = max(age, oldest.get(topic, age))
    ages = ", ".join(f"{topic} {age:.0f}" for topic, age in sorted(oldest.items()))
    mode = f"{account.mode} ({account.reason})" if account.reason else account.mode
    return (
        printable_line(mode) or NOTHING,
        _format_costs(account.planner_ms, ".2f"),
        _format_costs(account.tick_us, ".0f"),
        ages or NOTHING,
    )


def _format_costs(costs: Costs | None, digits: str) -> str:
    """Median and 99th percentile."""
    return NOTHING if costs is None else f"{costs.median:{digits}} / {costs.p99:{digits}}"
