import sys
from pathlib import Path

import pytest

from quadriga.faults.campaign import config_for
from quadriga.faults.catalogue import BY_NAME, FAULTS, select_faults
from quadriga.faults.fault import REALTIME_ROBOTS, Draw, FaultScene, TeamFault
from quadriga.faults.link_faults import LINK_FAULTS
from quadriga.faults.trial import draw_fault
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.members import OPERATOR
from quadriga.shared.robots.registry import ROBOTS
from quadriga.sim_server.world.faults import build_components, parse_faults
from quadriga.team.launch import Launch, ProcessSpec, process_table

_SLEEPER = ProcessSpec(OPERATOR, (sys.executable, "-c", "import time; time.sleep(60)"), 1.0)


def test_faults_by_name_in_the_order_of_the_table() -> None:
    assert select_faults(["all"], Config()) == list(FAULTS)
    found = [fault.name for fault in select_faults(["imu-stuck", "agent-killed"], Config())]
    assert found == ["agent-killed", "imu-stuck"]
    with pytest.raises(ConfigError, match=r"fault: got 'imu-stack'.*did you mean 'imu-stuck'"):
        select_faults(["agent-killed", "imu-stack"], Config())


def test_a_fault_of_one_component_may_be_given_with_its_time(tmp_path: Path) -> None:
    (fault,) = select_faults(["r2/gyro stuck 4 0.5"], Config())
    assert (fault.given, fault.realtime) == (("r2", 4000), False)
    with fault.stage(Config(), Draw("r2", 4000, 1), tmp_path) as stage:
        assert stage.config.world.faults == "r2/gyro stuck 4 0.5"
    with pytest.raises(ConfigError, match=r"component 'giro'.*did you mean 'gyro'"):
        select_faults(["r2/giro stuck 4"], Config())
    with pytest.raises(ConfigError, match="robot 'r4'"):
        select_faults(["r4/gyro stuck 4"], Config())


# Those of links make a network each: tests/runtime.
@pytest.mark.parametrize(
    "fault", [fault for fault in FAULTS if fault not in LINK_FAULTS], ids=lambda fault: fault.name
)
def test_every_fault_is_one_that_can_be_made(fault: TeamFault, tmp_path: Path) -> None:
    draw = draw_fault(Config(), 7)
    for kind in ROBOTS:
        config = load(None, {"team.robot": kind})
        with fault.stage(config, draw, tmp_path) as stage:
            components = tuple(build_components(ROBOTS[kind]))
            parsed = parse_faults(stage.config.world.faults, ("r1", "r2", "r3"), components)
            assert bool(parsed) == (stage.strike is None) == (not fault.realtime)
            for found in parsed:
                assert found.robot == draw.robot
                assert found.start == draw.tick


@pytest.mark.parametrize(
    ("name", "robot", "lasts"),
    [
        ("agent-killed", "r3", None),
        ("agent-paused", "r3", 0.0),
        ("operator-paused", "", 0.0),
        ("router-frozen", "", None),
        ("router-paused", "", 0.0),
        ("sim-killed", "", None),
        ("agent-slow", "r3", 0.0),
        ("subscriber-slow", "", None),
        ("flood", "", 2.0),
    ],
)
def test_whom_a_fault_meets_and_whether_it_ends_is_known_before(
    name: str, robot: str, lasts: float | None, tmp_path: Path
) -> None:
    with BY_NAME[name].stage(Config(), Draw("r3", 3000, 7), tmp_path) as stage:
        assert (stage.robot, stage.lasts) == (robot, lasts)


def test_who_is_paused_goes_on(tmp_path: Path) -> None:
    draw = draw_fault(Config(), 7)
    with Launch([_SLEEPER], tmp_path) as launch:
        scene = FaultScene(Config(), draw, tmp_path, launch)
        with BY_NAME["operator-paused"].stage(Config(), draw, tmp_path) as stage:
            assert stage.strike is not None
            stage.strike(scene)
        pid = launch.pids[OPERATOR]
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
        assert state != "T"
        assert not scene.struck  # it leaves by itself


@pytest.mark.parametrize("name", ["clock-step", "clock-drift"])
def test_the_clocks_of_one_process_go_wrong(name: str, tmp_path: Path) -> None:
    draw = draw_fault(Config(), 7)
    rows = process_table(Config(), tmp_path, None, "")
    with BY_NAME[name].stage(Config(), draw, tmp_path) as stage:
        changed = [row.name for row in rows if stage.wrap(row) != row]
        assert len(changed) == 1
        (own,) = (row for row in rows if row.name == changed[0])
        assert stage.wrap(own).command[5:] == own.command[3:]
        assert (tmp_path / "clock").read_text(encoding="ascii") == "0 0"
        assert stage.detail.startswith(f"of {own.name}, by ")
        assert stage.robot in ("", own.name)


def test_chance_of_the_seed_alone_decides_whom_and_when() -> None:
    draws = [draw_fault(Config(), seed) for seed in range(60)]
    assert draws == [draw_fault(Config(), seed) for seed in range(60)]
    assert {draw.robot for draw in draws} == {"r1", "r2", "r3"}
    begin = Config().gait.stand_ms
    assert all(begin + 1500 <= draw.tick <= begin + 4000 for draw in draws)


def test_in_real_time_no_more_robots_walk_than_a_computer_keeps_up_with() -> None:
    config = load(None, {"team.robots": 5})
    robots = {fault.realtime: config_for(config, fault).team.robots for fault in FAULTS}
    assert robots == {True: REALTIME_ROBOTS, False: 5}
    alone = load(None, {"team.robots": 1})
    assert {config_for(alone, fault).team.robots for fault in FAULTS} == {1}
