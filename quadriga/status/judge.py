"""What is wrong with a team, in one line each: pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from quadriga.doctor.health import WELL
from quadriga.recordings.late_commands import overloaded
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import max_ages
from quadriga.shared.modes import STAND, STANDING_UP, WALK
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import STATUS
from quadriga.status.record import Account, MemberStatus, TeamReading

# Share of a key's messages that did not come, of which is spoken: a listener on a busy machine
# misses some that the team itself has.
_LOST: Final = 0.01
_SOUND: Final = frozenset((STAND, WALK, STANDING_UP))


def find_problems(
    config: Config, linked: bool, reading: TeamReading, members: Sequence[MemberStatus]
) -> tuple[str, ...]:
    """All that is wrong, the gravest first.

    Args:
        config: the team's configuration.
        linked: whether anybody is linked to who looks.
        reading: what the team's messages tell.
        members: its processes.
    """
    if not linked:
        where = f"team {config.team.name!r} at {config.bus.endpoint}"
        return (f"nobody of {where} is linked to this process: it does not run, or runs elsewhere",)
    walks = reading.tick >= 0
    found = list[str]()
    for member in members:
        found += [f"{member.name}: {member.health}"] * (member.health != WELL)
    for robot in robot_names(config.team.robots):
        found += [f"{robot} {text}" for text in _of_robot(config, reading, robot)] if walks else []
    for robot, share in overloaded(reading.late).items():
        found.append(f"{robot}: {share:.0%} of its commands came late: too much for its computer?")
    for topic in reading.topics:
        lost = reading.lost.get(topic.key, 0)
        if lost > _LOST * (lost + topic.messages):
            found.append(f"{topic.key}: {lost:,} messages lost")
    return tuple(found)


def _of_robot(config: Config, reading: TeamReading, robot: str) -> Iterator[str]:
    """What is wrong with a robot of a team that walks, by what its agent told."""
    account = reading.accounts.get(robot)
    if account is None:
        if not config.team.agent_command:  # which need not
            yield "says nothing of itself"
        return
    # A team's time may be far slower than the wall clock, and then so are its words.
    patience = max_ages(config)[STATUS.name] / max(reading.pace or 0.0, 1e-3)
    if reading.pace is not None and account.age_ms > patience:
        yield f"has said nothing for {1e-3 * account.age_ms:.1f} s"
    if account.mode not in _SOUND or account.reason:
        yield f"is in mode {account.mode}{f', {account.reason}' if account.reason else ''}"
    if account.mode == WALK:
        yield from _old_inputs(config, account)


def _old_inputs(config: Config, account: Account) -> Iterator[str]:
    limits = max_ages(config)
    for name, age in sorted(account.ages_ms.items()):
        limit = limits.get(name.partition(".")[0], 0)
        if limit and age > limit:
            yield f"uses {name} {age:.0f} ms old, of at most {limit}"
