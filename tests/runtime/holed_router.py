"""A router whose rules have a hole for one kind of message, over and over: what its check says.

A process of its own, since the router reads Zenoh's log from the standard output.
"""

from __future__ import annotations

import sys
from pathlib import Path

from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.team import rule_check
from quadriga.team.audit import Audit, RefusalLog
from quadriga.team.router_rules import router_rules

HOLES = {  # Zenoh's name of the message, its way, and what the error names
    ("put", "ingress"): "'denied': 1",
    ("delete", "ingress"): "'delete': 1",
    ("declare_subscriber", "ingress"): "declare subscriber on team/probe/listened",
    ("declare_queryable", "ingress"): "declare queryable on team/probe/offered",
    ("query", "ingress"): "query on team/probe/asked",
    ("reply", "ingress"): "reply on team/probe/forged",
    ("liveliness_token", "ingress"): "liveliness token on team/stranger/probe/token",
    ("declare_liveliness_subscriber", "ingress"): (
        "declare liveliness subscriber on team/probe/watched/by/somebody"
    ),
    ("liveliness_query", "ingress"): "liveliness query on team/probe/counted/by/somebody",
    ("put", "egress"): "hear put on team/probe/deaf",
    ("declare_subscriber", "egress"): "hear declare subscriber on not-team/probe/listener",
    ("declare_queryable", "egress"): "hear declare queryable on not-team/probe/answerer",
}


def say(config: Config, log: RefusalLog, kind: str, flow: str) -> str:
    """What the check says of rules that permit the probe everything of one kind."""
    rules = router_rules(config)
    control = rules["access_control"]
    hole = {"id": "hole", "messages": [kind], "flows": [flow], "key_exprs": ["**"]}
    control["rules"].append(hole | {"permission": "allow"})
    (probe,) = (each for each in control["policies"] if each["subjects"] == ["probe"])
    probe["rules"].append("hole")
    log.take()
    with Bus.route(config.bus.endpoint, config.team.name, config.bus, rules) as bus:
        try:
            rule_check.check_rules(bus, config, config.bus.endpoint, Audit(bus, log, {}).tell)
        except BusError as error:
            return str(error)
    return "in force"


if __name__ == "__main__":
    rule_check._WAIT = 1.5  # type: ignore[misc]
    given, found = load(Path(sys.argv[1])), RefusalLog()
    for kind, flow in HOLES:
        print(f"{kind} {flow}: {say(given, found, kind, flow)}", file=sys.stderr, flush=True)
