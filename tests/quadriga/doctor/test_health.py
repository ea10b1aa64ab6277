"""Healthy is who answers, is ready, hears all others and agrees with them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from quadriga.doctor.health import judge_team
from quadriga.shared.about import HERE, WARMING_UP
from quadriga.shared.bus.diagnostics import TeamView
from quadriga.shared.members import team_members
from tests.shared.bus.abouts import NAMES, SIM, about, view

TEAM = [m for m in team_members(("r1", "r2"), central=False, recorded=False) if m.name in NAMES]
EVERYBODY = (SIM, about("r1"), about("r2"))


def lines(seen: TeamView) -> dict[str, str]:
    return judge_team(TEAM, seen)


def r2_and(**changes: object) -> TeamView:
    return view(SIM, about("r1"), about("r2", **changes))


def test_a_team_that_hears_and_trusts_each_other_is_well() -> None:
    assert set(lines(view(*EVERYBODY))) == NAMES | {"router", "doctor"}
    assert set(lines(view(*EVERYBODY)).values()) == {"well"}


@pytest.mark.parametrize(
    ("seen", "line"),
    [
        (r2_and(sees=("sim",)), "not well: does not see r1"),
        (replace(r2_and(sees=("sim",)), here=NAMES - {"r1"}), "not well: does not hear r1"),
        (r2_and(stage=HERE, sees=("sim", "r1")), "not well: here, waits for the others"),
        (r2_and(stage=WARMING_UP), "not well: still warming up"),
        (r2_and(version="9"), "not well: another version: 9, sim has 0.1.0"),
        (view(SIM, about("r1")), "not well: here, but does not answer"),
    ],
)
def test_who_is_not_is_told_with_the_reason(seen: TeamView, line: str) -> None:
    found = lines(seen)
    assert found.pop("r2") == line
    assert set(found.values()) == {"well"}, "the others hear all"


def test_a_wall_clock_that_is_off_is_no_illness() -> None:
    assert lines(r2_and(wall_ns=10**18 - 10**9))["r2"] == "well"


def test_who_lost_a_peer_is_not_well_either() -> None:
    left = (replace(SIM, sees=("r1",)), about("r1", sees=("sim",)))
    found = lines(view(*left, here=frozenset({"sim", "r1"})))
    assert found["sim"] == found["r1"] == "not well: does not hear r2"
    assert found["r2"].startswith("not well: not on the bus")


def test_without_a_link_nothing_is_known_to_be_well() -> None:
    found = lines(view(linked=False, here=frozenset()))
    assert found.pop("doctor") == "well"
    assert found.pop("router") == "not well: the doctor has no link to it"
    assert set(found.values()) == {"not well: no link to anyone"}
