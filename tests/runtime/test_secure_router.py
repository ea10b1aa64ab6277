"""A router with certificates: a team walks through it; it serves with its rules or not at all."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.wire.topics import REFUSED
from quadriga.team import rule_check
from quadriga.team.router_rules import router_rules
from quadriga.team.rule_check import check_rules
from tests.runtime.conftest import Make, Team
from tests.runtime.fortress import Fortress, make_fortress, serving
from tests.runtime.holed_router import HOLES
from tests.runtime.test_lockstep import payloads


def untold() -> list[Any]:
    return []


def test_the_same_walk_as_without_a_router_and_nothing_is_refused(
    make_team: Make, tmp_path: Path
) -> None:
    direct = make_team(recorder__enabled=True, world__seconds=0.5)
    expected = payloads(direct.run())
    folder = tmp_path / "secure"
    folder.mkdir()
    fortress = make_fortress(folder)
    team = Team(
        replace(direct.config, bus=replace(fortress.config.bus, barrier_timeout=60)), folder
    )
    with serving(fortress):
        served = len(fortress.said)
        walked = payloads(team.run())
    # What the router had refused to its own probe before, it may tell once the walk has begun.
    walked.pop(REFUSED.key("team"), None)
    assert walked == expected
    assert fortress.said[served:] == []
    assert [line for line in fortress.said[:served] if "probe.1" not in line] == [
        f"routing at {fortress.config.bus.endpoint}\n"
    ]


@pytest.fixture
def fortress(tmp_path: Path) -> Fortress:
    return make_fortress(tmp_path)


def check(fortress: Fortress, rules: dict[str, Any]) -> None:
    """Serve with these rules, and ask whether they are in force."""
    config = fortress.config
    with Bus.route(config.bus.endpoint, config.team.name, config.bus, rules) as bus:
        check_rules(bus, config, config.bus.endpoint, untold)


def test_rules_that_are_not_enabled_are_an_error(fortress: Fortress) -> None:
    rules = router_rules(fortress.config)
    del rules["access_control"]["enabled"]
    with pytest.raises(BusError, match=r"rules of the router: got .*'denied': 1"):
        check(fortress, rules)


@pytest.mark.parametrize(
    ("without", "through"), [("low_pass_filter", "'large': 1"), ("downsampling", "'many': 3")]
)
def test_limits_that_are_not_in_force_are_an_error(
    fortress: Fortress, without: str, through: str
) -> None:
    rules = router_rules(fortress.config)
    del rules[without]
    with pytest.raises(BusError, match=f"rules of the router: got .*{through}"):
        check(fortress, rules)


def test_rules_that_deny_what_is_permitted_are_an_error(
    fortress: Fortress, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rule_check, "_WAIT", 0.3)
    rules = router_rules(fortress.config)
    rules["access_control"]["policies"] = []
    with pytest.raises(BusError, match="nothing from probe"):
        check(fortress, rules)


def test_a_refusal_that_nobody_tells_is_an_error(
    fortress: Fortress, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rule_check, "_WAIT", 0.3)
    with pytest.raises(BusError, match="without a word: put on team/probe/denied, delete on"):
        check(fortress, router_rules(fortress.config))


def test_one_kind_of_message_that_is_not_refused_is_an_error_that_names_it(
    fortress: Fortress,
) -> None:
    file = fortress.folder / "config.toml"
    file.write_text(to_toml(fortress.config), encoding="utf-8")
    command = [sys.executable, "-m", "tests.runtime.holed_router", str(file)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    for (kind, flow), named in HOLES.items():
        (said,) = (line for line in run.stderr.splitlines() if line.startswith(f"{kind} {flow}: "))
        assert "rules of the router: got " in said
        assert named in said


def test_a_router_does_not_guess_who_is_revoked(fortress: Fortress) -> None:
    fortress.certificates.revoked_file.unlink()
    with pytest.raises(ConfigError, match=r"router/revoked\.json: got No such file.*certs make"):
        router_rules(fortress.config)


def test_without_a_router_there_is_one_clear_error(fortress: Fortress) -> None:
    with pytest.raises(BusError, match=r"Unable to connect: Connection refused.*quadriga router"):
        fortress.bus("sim")


def test_who_has_no_certificate_does_not_even_try(fortress: Fortress) -> None:
    with pytest.raises(ConfigError, match=r"player/authority\.pem: got no such file"):
        fortress.bus("player")
