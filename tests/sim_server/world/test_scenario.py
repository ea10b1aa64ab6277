import numpy as np

from quadriga.sim_server.world.payload import build_loads
from quadriga.sim_server.world.scenario import build_scenario
from tests.sim_server.standing import configured


def test_forces_add_up_and_end() -> None:
    config = configured(3, push="all:10:0:1:1,r2:20:90:1.5:1")
    scenario = build_scenario(config, build_loads(config))
    assert scenario.changes() == {1000, 2000, 1500, 2500}
    along, left, none = np.array([10.0, 0.0, 0.0]), np.array([0.0, 20.0, 0.0]), np.zeros(3)
    expected = {
        999: [none] * 3,
        1000: [along] * 3,
        1999: [along, along + left, along],
        2000: [none, left, none],
        2500: [none] * 3,
    }
    for tick, forces in expected.items():
        np.testing.assert_allclose(scenario.forces(tick), forces, atol=1e-12)


def test_events_announce_what_was_configured() -> None:
    config = configured(
        3, push="r3:80:90:2:0.2,all:5:0:1:1", payload=9.0, payload_on="r2", terrain="boxes"
    )
    events = build_scenario(config, build_loads(config)).events
    assert [(event.tick, event.kind, event.robot) for event in events] == [
        (0, "start", ""),
        (0, "terrain", ""),
        (0, "payload", "r2"),
        (1000, "push", "r1"),
        (1000, "push", "r2"),
        (1000, "push", "r3"),
        (2000, "push", "r3"),
    ]
    assert events[2].detail == "9 kg"
    assert events[-1].detail == "80 N towards 90 deg for 0.2 s"
    assert events[-1].stamp_ns == 2_000_000_000


def test_what_is_drawn_is_announced() -> None:
    config = configured(
        3,
        payload=6.0,
        payload_on="r1:2,r3",
        payload_scatter=0.05,
        push_force=90.0,
        weak_motor="r2:FL_calf:1.5",
        weak_share=0.3,
        terrain="slope",
        seconds=5.0,
    )
    scenario = build_scenario(config, build_loads(config))
    (_, ground, *payloads, fault, push) = scenario.events
    assert ground.detail == "slope of 8 deg up to 0.05 m, seed 0"
    assert [(event.robot, event.detail.split(",")[0]) for event in payloads] == [
        ("r1", "4 kg"),
        ("r3", "2 kg"),
    ]
    assert all("mm ahead" in event.detail for event in payloads)
    assert (fault.tick, fault.kind, fault.robot) == (1500, "fault", "r2")
    assert fault.detail == "FL_calf gives 30 % of its torque"
    assert push.kind == "push"
    assert push.tick == scenario.pushes[0].start
    assert push.detail.startswith("90 N towards ")


def test_a_motor_is_weak_from_its_tick_on_and_gives_what_is_announced() -> None:
    config = configured(2, weak_motor="r2:FR_hip:1,r2:FR_hip:2", weak_share=0.5)
    scenario = build_scenario(config, build_loads(config))
    assert scenario.weakenings() == {1000, 2000}
    assert (scenario.strength(999) == 1.0).all()
    details = [event.detail for event in scenario.events if event.kind == "fault"]
    assert details == ["FR_hip gives 50 % of its torque"] * 2
    for tick, share in ((1000, 0.5), (1999, 0.5), (2000, 0.5)):
        strength = scenario.strength(tick)
        assert strength[1, 3] == share
        assert strength.sum() == 23 + share
