"""Who may send and hear what, and how much, from the table of topics; Zenoh's rules for a router.

A certificate's common name is the identity of its process. Whatever is not permitted is denied.
Seen from the router, what a process sends comes in (`ingress`) and what it hears goes out
(`egress`).

A message that is larger than any may be is dropped before anybody decodes it. No key has a
rate: Zenoh's is the least time between two messages, without a burst, and what a slow link has held
up comes at once. With ten times the rate of states up to one in 300 was dropped in real time.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from quadriga.shared import members, topics
from quadriga.shared.about import about_key
from quadriga.shared.codec import MAX_BYTES
from quadriga.shared.config.sections import Config
from quadriga.shared.members import LEADS, OBSERVER, ROUTER, Member, Role
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import RECEIVED, STATE, TABLE, Topic

_OTHERS: Final = (members.LAUNCHER, *members.SPEAKERS, members.DOCTOR, OBSERVER, ROUTER)
_OBSERVER_NAME: Final = re.compile(r".+-\d+")  # such as echo-4711

_IN, _OUT, _BOTH = ["ingress"], ["egress"], ["ingress", "egress"]
_HEARERS: Final = (members.RECORDER, OBSERVER, members.DOCTOR)  # they hear all and say nothing
_OF_LEAD: Final = (topics.CLOCK, topics.TRUTH)  # only who drives time knows

_SPARE_SESSIONS: Final = 8  # for those who look on, and who has yet to be found dead


class Rights(NamedTuple):
    """The keys that one identity may publish on, and the key expressions that it may hear."""

    publishes: list[str]
    hears: list[str]


def team_identities(config: Config) -> tuple[Member, ...]:
    """Everybody who may be on a team's bus, whatever it records and however it plans.

    Each has a certificate of its name; those who only look on share that of `observer`.
    """
    team = members.team_members(
        robot_names(config.team.robots),
        central=True,
        recorded=True,
        plant_each=config.team.plant_per_robot,
    )
    return (*team, *(Member(name, Role(name, "")) for name in _OTHERS))


def identity_of(process: str) -> str:
    """The identity of a process by its name on the bus; those who look on end in their number."""
    return OBSERVER if _OBSERVER_NAME.fullmatch(process) else process


def team_rights(config: Config) -> dict[str, Rights]:
    """By name the rights of all on a team's bus but the router, which enforces them."""
    team, robots = config.team.name, robot_names(config.team.robots)
    found = dict[str, Rights]()
    for who in team_identities(config):
        role = who.role.name
        if role in _HEARERS:
            found[who.name] = Rights([], [f"{team}/**"])
        elif role != ROUTER:
            sent = [topic for topic in TABLE if topic is topics.ESTOP or role in topic.senders]
            of = who.robot if role == members.AGENT else "*"  # whose states it hears
            found[who.name] = Rights(
                [_key(t, team, name) for t in sent for name in _names(who, t, robots)],
                [_key(t, team, of if t is STATE else "*") for t in topics.topics_for(role)],
            )
    return found


def _key(topic: Topic, team: str, robot: str) -> str:
    """The key of a topic; states and commands have those of the plant link."""
    return (topic.link_key if topic in (STATE, topics.COMMAND) else topic.key)(team, robot)


def _names(who: Member, topic: Topic, robots: Sequence[str]) -> Sequence[str]:
    """The robots for whom a sender of a topic may speak; [""] of a topic that is for all."""
    if topic in _OF_LEAD and who.name not in LEADS:
        return ()
    if not topic.per_robot:
        return ("",)
    if topic in (topics.STATUS, topics.TICKS):
        return (who.name,)
    return (who.robot,) if who.robot else robots


def router_rules(config: Config) -> dict[str, Any]:
    """Zenoh's settings of a team's router: who may send and hear what, and how much."""
    return {
        "access_control": access_control(config),
        "transport/unicast/max_sessions": len(team_identities(config)) + _SPARE_SESSIONS,
        "transport/unicast/max_links": 1,  # the rules do not see a second link of a session
        "transport/link/rx/max_message_size": MAX_BYTES,
    }


def access_control(config: Config) -> dict[str, Any]:
    """Zenoh's `access_control`: everything denied but what the team's rights permit."""
    team = config.team.name
    tokens, questions = [f"{team}/*/*/*"], [f"{team}/*/{RECEIVED}", about_key(team, "*")]
    # What everybody with a valid certificate may do: see who is there, and ask how it is.
    common = [
        _rule("tokens-seen", ["liveliness_token"], _OUT, tokens),
        _rule("tokens-asked", ["liveliness_query", "declare_liveliness_subscriber"], _BOTH, tokens),
        # A publisher sends nothing before it knows that somebody listens.
        _rule("listeners-seen", ["declare_subscriber"], _OUT, [f"{team}/**", f"{team}/@link/**"]),
        _rule("questions", ["declare_queryable", "query", "reply"], _BOTH, questions),
    ]
    rules, subjects, policies = [*common], list[dict[str, Any]](), list[dict[str, Any]]()
    for name, rights in team_rights(config).items():
        own = [_rule(f"{name}-token", ["liveliness_token"], _IN, [f"{team}/{name}/*/*"])]
        if rights.publishes:
            own.append(_rule(f"{name}-publishes", ["put"], _IN, rights.publishes))
        if rights.hears:
            own.append(_rule(f"{name}-subscribes", ["declare_subscriber"], _IN, rights.hears))
            own.append(_rule(f"{name}-hears", ["put"], _OUT, rights.hears))
        rules += own
        subjects.append({"id": name, "cert_common_names": [name]})
        policies.append({"rules": [rule["id"] for rule in (*common, *own)], "subjects": [name]})
    return {
        "enabled": True,  # without it the whole block is silently nothing
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


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
