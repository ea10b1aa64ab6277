"""What keys mean: presets, periods, numbers of single robots, where an endpoint may be."""

from __future__ import annotations

from dataclasses import asdict, fields

import pytest

from quadriga.shared.config.endpoints import check_exposure, host_and_port, is_loopback
from quadriga.shared.config.load import load
from quadriga.shared.config.per_robot import carriers, friction_of_robots
from quadriga.shared.config.presets import PRESETS
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.config.timing import max_ages, periods
from quadriga.shared.errors import ConfigError
from quadriga.shared.topics import CONFIGURED, TABLE

NAMED = [(section, name) for section, presets in PRESETS.items() for name in presets]


@pytest.mark.parametrize(("section", "name"), NAMED)
def test_a_preset_sets_its_keys_and_leaves_the_others(section: str, name: str) -> None:
    """Going through the same checks as a user's values: names, types and ranges."""
    keys = {item.name: item for item in fields(getattr(Config(), section))}
    assert set(PRESETS[section]) == set(keys["preset"].metadata["choices"])
    assert not PRESETS[section][str(keys["preset"].default)]
    expected = asdict(getattr(Config(), section)) | {**PRESETS[section][name], "preset": name}
    found = load(None, {f"{section}.preset": name})
    assert asdict(found) == asdict(Config()) | {section: expected}


def test_the_papers_planner_has_its_weights_and_nothing_that_it_does_not_name() -> None:
    """Fawcett et al., section V.B: Q, R, horizons, 40 ms; U is the friction cone alone."""
    paper = load(None, {"planner.preset": "paper", "identification.preset": "paper"})
    planner = paper.planner
    assert planner.Q == (1e6, 1e5, 1e5, 2e5, 1e5, 1e4)
    assert planner.R == (0.05, 0.05, 0.5)
    assert (planner.N, planner.T_ini, planner.applied) == (25, 10, 4)
    assert (planner.interface, planner.tracked) == ("force", "outputs")
    assert planner.output_bounds == "none"
    assert planner.latency_ms == planner.damping == planner.exchanges == 0
    assert not planner.compensation
    assert min(planner.deviation_max) > 10 * paper.robot.weight
    assert min(planner.trust_range) > 1e3
    assert paper.identification.predictor == "pinv"


def test_periods_follow_the_configuration() -> None:
    assert (periods(Config())["plan"], periods(Config())["sim/truth"]) == (40, 10)
    keys = {"planner.applied": 2, "estimator.kind": "truth", "world.mode": "realtime"}
    other = periods(load(None, keys))
    assert (other["plan"], other["sim/truth"], other["status"]) == (20, 1, 0)
    bridged = {"team.plant": "robots", "team.plant_per_robot": True, "world.mode": "realtime"}
    assert periods(load(None, bridged))["state"] == 10


def test_what_the_table_says_holds_whatever_is_configured() -> None:
    for config in (Config(), load(None, {"planner.preset": "fast", "world.mode": "realtime"})):
        for topic in TABLE:
            assert topic.period_ms in (CONFIGURED, periods(config)[topic.name])
            assert topic.max_age_ms in (CONFIGURED, max_ages(config)[topic.name])


def test_a_plan_is_used_until_who_made_it_is_given_up() -> None:
    assert max_ages(Config())["plan"] == 360
    assert max_ages(load(None, {"planner.kind": "centralised"}))["plan"] == 368


NAMES = ("r1", "r2", "r3")


def test_who_is_named_carries_a_part_or_finds_another_friction() -> None:
    parts = {"team": (1.0, 1.0, 1.0), "r3, r1": (1.0, 0.0, 1.0), "r1:6,r2": (6.0, 1.0, 0.0)}
    assert {text: carriers(text, NAMES) for text in parts} == parts
    frictions = {"": (0.8, 0.8, 0.8), "r3: 0.5, r1:0.25": (0.25, 0.8, 0.5)}
    assert {text: friction_of_robots(text, 0.8, NAMES) for text in frictions} == frictions


WRONG = ("r4:1", "r1:1,", "r1:1,r1:2", "r1:", "r1:heavy", "r1:-1", "r1:nan", "1")


@pytest.mark.parametrize("text", WRONG)
def test_a_mistake_names_the_key(text: str) -> None:
    with pytest.raises(ConfigError, match=r"^world\.payload_on: "):
        carriers(text, NAMES)
    with pytest.raises(ConfigError, match=r"^world\.friction_of: "):
        friction_of_robots(text, 0.8, NAMES)
    with pytest.raises(ConfigError):
        carriers("", NAMES)
    with pytest.raises(ConfigError):
        friction_of_robots("r2", 0.8, NAMES)


HERE = ("tcp/127.0.0.1:7447", "tcp/127.9.8.7:0", "tcp/localhost:1", "tcp/[::1]:7447")
NO_ENDPOINT = ("", "tcp", "carrier-pigeon/roof:1")  # left to the bus
AWAY = (
    "tcp/0.0.0.0:7447",
    "udp/10.0.0.1:7447",
    "tcp/router:7447",
    "tcp/[fe80::1]:7447",
    "ws/10.0.0.1:80",
    "tcp/127.0.0.1.example.org:7447",
    "serial//dev/ttyUSB0",
    "tcp/10.0.0.1:7447#iface=lo",
)


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_only_the_loopback_needs_neither_certificates_nor_a_second_word(mode: str) -> None:
    for endpoint in (*HERE, *NO_ENDPOINT):
        assert is_loopback(endpoint)
        check_exposure(BusConfig(mode=mode), "bus.endpoint", endpoint)
    for endpoint in AWAY:
        with pytest.raises(ConfigError) as caught:
            check_exposure(BusConfig(mode=mode), "bus.endpoint", endpoint)
        assert caught.value.name == "bus.endpoint"
        check_exposure(BusConfig(mode=mode, plaintext=True), "bus.endpoint", endpoint)


def test_certificates_are_for_clients_of_a_router() -> None:
    check_exposure(BusConfig(mode="client"), "bus.endpoint", "tls/10.0.0.1:7447")
    with pytest.raises(ConfigError, match=r"bus\.mode: got 'peer' with tls/10.0.0.1:7447"):
        check_exposure(BusConfig(), "bus.endpoint", "tls/10.0.0.1:7447")


@pytest.mark.parametrize(
    "endpoint", ["tls/", "tls/host", "tls/host:x", "tls/host:70000", "tls/:7447", "tls/a:1#b=c"]
)
def test_an_endpoint_with_certificates_is_a_host_and_a_port(endpoint: str) -> None:
    assert host_and_port("tls/[::1]:7447") == ("::1", 7447)
    assert host_and_port("tls/router.lab:1") == ("router.lab", 1)
    with pytest.raises(ConfigError, match="tls/HOST:PORT"):
        check_exposure(BusConfig(mode="client"), "bus.endpoint", endpoint)
