"""Who may send and hear what, from the table of topics; Zenoh's rules for a router.

Whatever is not permitted is denied. Seen from the router, what a process sends comes in (`ingress`)
and what it hears goes out (`egress`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from quadriga.shared.config.sections import Config
from quadriga.shared.members import AGENT, DOCTOR, LEADS, OBSERVER, RECORDER, ROUTER
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.security.roll import Identity, team_roll, valid_names
from quadriga.shared.wire.about import QUESTIONS
from quadriga.shared.wire.topic import Topic
from quadriga.shared.wire.topics import (
    CLOCK,
    CLOCK_ANSWER,
    ESTOP,
    RECEIVED,
    STATE,
    STATUS,
    TABLE,
    TRUTH,
)

_IN, _OUT, _BOTH = ["ingress"], ["egress"], ["ingress", "egress"]
_HEARERS: Final = (RECORDER, OBSERVER, DOCTOR)  # they hear everything and say nothing
_OF_LEAD: Final = (CLOCK, TRUTH, CLOCK_ANSWER)  # only who drives time knows


@dataclass(frozen=True, slots=True)
class Rights:
    """What one identity may do.

    Attributes:
        identity: who.
        publishes: keys that it may publish on.
        hears: key expressions that it may subscribe to.
    """

    identity: Identity
    publishes: tuple[str, ...]
    hears: tuple[str, ...]


def team_rights(config: Config) -> tuple[Rights, ...]:
    """The rights of everybody on a team's roll but the router, which enforces them."""
    team, robots = config.team.name, robot_names(config.team.robots)
    return tuple(
        Rights(who, _published(who, team, robots), _heard(who, team))
        for who in team_roll(config)
        if who.role != ROUTER
    )


def access_control(config: Config, revoked: Mapping[str, int]) -> dict[str, Any]:
    """Zenoh's `access_control`: everything denied but what the team's rights permit.

    Args:
        config: the team's configuration.
        revoked: by identity the number of the last certificate that is not valid any more.
    """
    team = config.team.name
    common = _common_rules(team)
    rules, subjects, policies = [*common], list[dict[str, Any]](), list[dict[str, Any]]()
    for rights in team_rights(config):
        name = rights.identity.name
        own = _own_rules(rights, team)
        rules += own
        names = valid_names(name, revoked.get(name, 0))
        subjects.append({"id": name, "cert_common_names": names})
        policies.append({"rules": [rule["id"] for rule in (*common, *own)], "subjects": [name]})
    return {
        "enabled": True,  # without it the whole block is silently nothing
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _published(who: Identity, team: str, robots: Sequence[str]) -> tuple[str, ...]:
    if who.role in _HEARERS:
        return ()
    return tuple(
        topic.key(team, name)
        for topic in TABLE
        if topic is ESTOP or who.role in topic.senders
        for name in _names_in_keys(who, topic, robots)
    )


def _names_in_keys(who: Identity, topic: Topic, robots: Sequence[str]) -> Iterable[str]:
    """The robots for whom a sender of a topic may speak; [""] of a topic that is for all."""
    if topic in _OF_LEAD and who.name not in LEADS:
        return ()
    if not topic.per_robot:
        return ("",)
    if topic is STATUS:
        return (who.name,)
    return (who.robot,) if who.robot and topic is not CLOCK_ANSWER else robots


def _heard(who: Identity, team: str) -> tuple[str, ...]:
    if who.role in _HEARERS:
        return (f"{team}/**",)
    return tuple(
        topic.key(team, who.robot if topic is STATE and who.role == AGENT else "*")
        for topic in TABLE
        if who.role in topic.receivers
    )


def _common_rules(team: str) -> list[dict[str, Any]]:
    """What everybody with a valid certificate may do: see who is there, and ask how it is."""
    tokens = [f"{team}/*/*/*"]
    return [
        _rule("tokens-seen", ["liveliness_token"], _OUT, tokens),
        _rule("tokens-asked", ["liveliness_query", "declare_liveliness_subscriber"], _BOTH, tokens),
        # A publisher sends nothing before it knows that somebody listens.
        _rule("listeners-seen", ["declare_subscriber"], _OUT, [f"{team}/**"]),
        _rule("questions", ["declare_queryable", "query", "reply"], _BOTH, questions_of(team)),
    ]


def questions_of(team: str) -> list[str]:
    """What anybody may ask a process: whether all has arrived, and who it is."""
    return [f"{team}/*/{RECEIVED}", *(question.key(team, "*") for question in QUESTIONS)]


def _own_rules(rights: Rights, team: str) -> list[dict[str, Any]]:
    name = rights.identity.name
    rules = [_rule(f"{name}-token", ["liveliness_token"], _IN, [f"{team}/{name}/*/*"])]
    if rights.publishes:
        rules.append(_rule(f"{name}-publishes", ["put"], _IN, rights.publishes))
    if rights.hears:
        rules.append(_rule(f"{name}-subscribes", ["declare_subscriber"], _IN, rights.hears))
        rules.append(_rule(f"{name}-hears", ["put"], _OUT, rights.hears))
    return rules


def _rule(
    name: str, messages: Sequence[str], flows: Sequence[str], keys: Sequence[str]
) -> dict[str, Any]:
    """One rule; without `interfaces` it holds for every link."""
    return {
        "id": name,
        "messages": list(messages),
        "flows": list(flows),
        "permission": "allow",
        "key_exprs": list(keys),
    }
