"""Who belongs to a team, and who may not join one that is complete or walks."""

from __future__ import annotations

from threading import Thread

import pytest

from quadriga.shared.bus.barrier import REJOINS, STARTS, meet, members, start_together
from quadriga.shared.bus.barrier import join as take_part
from quadriga.shared.bus.zenoh_bus import READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.team.endpoint import free_endpoint


def team(**more: object) -> Config:
    keys = {
        "team.robots": 1,
        "bus.endpoint": free_endpoint(),
        "recorder.enabled": False,
        "bus.barrier_timeout": 10.0,
    }
    return load(None, {**keys, **more})


def never() -> bool:
    return False


def test_members() -> None:
    assert members(team()) == {"sim", "operator", "r1"}
    three = load(None, {"team.robots": 3})
    assert members(three) == {"sim", "operator", "recorder", "r1", "r2", "r3"}


def join(config: Config, name: str) -> Bus:
    return Bus.open(config.bus, config.team.name, name)


def all_meet(config: Config, *buses: Bus) -> None:
    threads = [Thread(target=meet, args=(bus, config, never)) for bus in buses]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def test_the_world_starts_when_all_are_ready_and_nobody_joins_later() -> None:
    config = team()
    with join(config, "sim") as sim, join(config, "r1") as r1, join(config, "operator") as operator:
        all_meet(config, sim, r1, operator)
        r1.declare(READY)
        operator.declare(READY)
        assert start_together(sim, config, never)
        with (
            join(config, "r1") as late,
            pytest.raises(BusError, match="a team that walks already, expected a network without"),
        ):
            meet(late, config, never)


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_an_agent_and_an_operator_join_a_team_that_walks(
    mode: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """But in lock-step no agent does."""
    config = team(**{"world.mode": mode})
    buses = {name: join(config, name) for name in ("sim", "r1", "operator")}
    all_meet(config, *buses.values())
    for name in ("r1", "operator"):
        buses[name].declare(READY)
    assert start_together(buses["sim"], config, never)
    with (
        join(config, "r1") as double,
        pytest.raises(BusError, match=r"walks already|two processes"),
    ):
        take_part(double, config, never)
    for name in ("r1", "operator"):
        buses[name].close()
        with join(config, name) as again:
            if (name, mode) == ("r1", "lockstep"):
                with pytest.raises(BusError, match="no agent can be started again"):
                    take_part(again, config, never)
            else:
                assert take_part(again, config, never) == REJOINS
                said = f"quadriga: {name} joins team 'team', which walks"
                assert said in capsys.readouterr().err
    buses["sim"].close()


def test_who_is_started_with_its_team_starts() -> None:
    config, found = team(), dict[str, str]()
    buses = [join(config, name) for name in ("sim", "r1", "operator")]

    def start(bus: Bus) -> None:
        found[bus.name] = take_part(bus, config, never)

    threads = [Thread(target=start, args=(bus,)) for bus in buses]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == dict.fromkeys(("sim", "r1", "operator"), STARTS)
    for bus in reversed(buses):
        bus.close()


@pytest.mark.parametrize("again", ["plant_r2", "r2"])
def test_a_robot_that_is_started_again_does_not_join_a_team_that_walks(again: str) -> None:
    """Its bridge, or its agent, even where the one before is gone already."""
    each = {"team.robots": 2, "team.plants": "each", "team.yokes": "none", "planner.kind": "none"}
    config = team(**each)
    names = sorted(members(config), key=lambda name: name != "plant_r1")
    buses = {name: join(config, name) for name in names}
    all_meet(config, *buses.values())
    for name, bus in buses.items():
        if name != "plant_r1":
            bus.declare(READY)
    assert start_together(buses["plant_r1"], config, never)
    buses[again].close()
    with (
        join(config, again) as late,
        pytest.raises(BusError, match="a team that walks already, expected a network without"),
    ):
        meet(late, config, never)
    for bus in reversed(buses.values()):
        bus.close()


def test_a_team_does_not_start_with_two_of_one_name() -> None:
    config = team()
    with (
        join(config, "sim") as sim,
        join(config, "r1") as r1,
        join(config, "operator") as operator,
        join(config, "r1") as double,
    ):
        all_meet(config, sim, r1, operator)
        for bus in (r1, operator, double):
            bus.declare(READY)
        double.declare("here")
        double.wait_for("here", {"sim", "operator"}, 10.0, never)
        sim.wait_for(READY, {"r1", "operator"}, 10.0, never)
        deadline = 100
        while not sim.duplicates("here") and deadline:
            sim.get(0.05)
            deadline -= 1
        with pytest.raises(BusError, match=r"two processes named r1, expected one of each name"):
            start_together(sim, config, never)


def test_the_sim_server_names_who_is_not_ready() -> None:
    config = team(**{"bus.barrier_timeout": 1.0})
    with join(config, "sim") as sim, join(config, "r1") as r1, join(config, "operator") as operator:
        all_meet(config, sim, r1, operator)
        operator.declare(READY)
        with pytest.raises(BusError, match="no r1 at stage 'ready'"):
            start_together(sim, config, never)
