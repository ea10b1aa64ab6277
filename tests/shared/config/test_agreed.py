"""Which keys all processes of a team must have the same values of."""

from __future__ import annotations

import pytest

from quadriga.shared.config.agreed import agreed_keys
from quadriga.shared.config.load import load

DEFAULT = agreed_keys(load())


def test_a_key_is_told_by_name_with_its_value_in_json() -> None:
    assert {"world.seed=0", 'team.name="team"', "recorder.enabled=true"} <= {*DEFAULT}
    assert agreed_keys(load()) == DEFAULT == tuple(sorted(DEFAULT))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("bus.endpoint", "tcp/10.0.0.1:7447"),
        ("bus.listen", "tcp/0.0.0.0:0"),
        ("bus.mode", "client"),
        ("bus.barrier_timeout", 900.0),
        ("runtime.priority", "ordinary"),
        ("recorder.chunk_kib", 512),
        ("bridge.interface", "eth1"),
        ("bridge.endpoint", "10.0.0.2:8007"),
        ("world.scenario", "mine"),
    ],
)
def test_what_is_a_computer_s_own_may_differ(key: str, value: object) -> None:
    assert agreed_keys(load(None, {key: value})) == DEFAULT


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("world.seed", 4),
        ("team.robots", 2),
        ("planner.N", 21),
        ("controller.mu", 0.5),
        ("bridge.torque_share", 0.5),
        ("bus.clock_timeout", 0.6),
        ("recorder.enabled", False),
    ],
)
def test_everything_else_must_be_the_same(key: str, value: object) -> None:
    differing = {*agreed_keys(load(None, {key: value}))} ^ {*DEFAULT}
    assert {line.partition("=")[0] for line in differing} == {key}


def test_of_a_long_value_a_digest_is_told() -> None:
    rows = "".join(f"{t},0.1,0,0;" for t in range(50))
    traced = [
        load(None, {"reference.trace": f"t,vx,vy,wz;{rows}{end},0.2,0,0"}) for end in (60, 61)
    ]
    said = [next(x for x in agreed_keys(c) if x.startswith("reference.trace=")) for c in traced]
    assert all(len(line) == len("reference.trace=sha256:") + 16 for line in said)
    assert said[0] != said[1]
