import pytest

from quadriga.shared.errors import ConfigError
from quadriga.sim_server.world.faults.fault import ComponentFault, parse_faults

ROBOTS, COMPONENTS = ("r1", "r2"), ("imu", "motor_FL")


def test_a_fault_names_robot_component_kind_and_time() -> None:
    found = parse_faults("r2/imu stuck 4 0.5, r1/motor_FL off 0", ROBOTS, COMPONENTS)
    assert found == (
        ComponentFault("r2", "imu", "stuck", 4000, 4500),
        ComponentFault("r1", "motor_FL", "off", 0, None),
    )
    assert parse_faults("", ROBOTS, COMPONENTS) == ()


def test_a_fault_holds_from_its_start_until_before_its_stop() -> None:
    limited = ComponentFault("r1", "imu", "off", 10, 12)
    endless = ComponentFault("r1", "imu", "off", 10)
    assert [limited.holds(tick) for tick in (9, 10, 11, 12)] == [False, True, True, False]
    assert endless.holds(10**7)
    assert not endless.holds(9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r1/imu stuck", "robot/component kind start"),
        ("r1 imu stuck 4", "robot/component kind start"),
        ("r3/imu stuck 4", "robot 'r3'"),
        ("r1/imus stuck 4", "component 'imus'.*did you mean 'imu'"),
        ("r1/imu stack 4", "kind 'stack'.*did you mean 'stuck'"),
        ("r1/imu stuck -1", "start '-1'"),
        ("r1/imu stuck nan", "start 'nan'"),
        ("r1/imu stuck 4 0", "duration '0'"),
        ("r1/imu stuck 4,", "robot/component kind start"),
    ],
)
def test_a_wrong_fault_names_the_key_and_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.faults: .*{message}"):
        parse_faults(text, ROBOTS, COMPONENTS)
