import signal

import pytest

from quadriga.faults.campaign import REALTIME_ROBOTS, config_for
from quadriga.faults.catalogue import FAULTS, OWN, TeamFault, select_faults
from quadriga.shared.bus.barrier import members
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.members import ROUTER
from quadriga.shared.robot.robots import ROBOTS
from quadriga.sim_server.world.faults.components import build_components
from quadriga.sim_server.world.faults.fault import parse_faults


def test_faults_by_name_in_the_order_of_the_table() -> None:
    assert select_faults(["all"]) == list(FAULTS)
    found = [fault.name for fault in select_faults(["imu-stuck", "agent-killed"])]
    assert found == ["agent-killed", "imu-stuck"]
    with pytest.raises(ConfigError, match=r"fault: got 'imu-stack'.*did you mean 'imu-stuck'"):
        select_faults(["agent-killed", "imu-stack"])


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_every_fault_is_one_that_can_be_made(fault: TeamFault) -> None:
    assert bool(fault.process) != bool(fault.component)
    assert bool(fault.process) == bool(fault.signals)
    assert fault.process in {"", OWN, ROUTER, *members(Config())}
    if fault.signals:
        times = [after for _, after in fault.signals]
        assert times == sorted(times)
        assert times[0] == 0.0
    if fault.component:
        for kind in ROBOTS.values():
            parse_faults(f"r1/{fault.component} 1", ("r1",), tuple(build_components(kind)))


def test_who_is_paused_goes_on() -> None:
    for fault in FAULTS:
        if fault.name.endswith("-paused"):
            assert [number for number, _ in fault.signals] == [signal.SIGSTOP, signal.SIGCONT]


def test_in_real_time_no_more_robots_walk_than_a_computer_keeps_up_with() -> None:
    config = load(None, {"team.robots": 5})
    robots = {fault.realtime: config_for(config, fault).team.robots for fault in FAULTS}
    assert robots == {True: REALTIME_ROBOTS, False: 5}
    alone = load(None, {"team.robots": 1})
    assert {config_for(alone, fault).team.robots for fault in FAULTS} == {1}
