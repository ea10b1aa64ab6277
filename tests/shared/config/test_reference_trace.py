"""A trace is replayed as it stands in its file, over and over, from where the seed says."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from quadriga.shared.config.load import build, load
from quadriga.shared.config.reference_trace import Trace, trace_of
from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ConfigError

GOOD = "# a comment\nt,vx,vy,wz\n0,0,0,0\n1.0,0.4,0.1,-0.2\n2.0,0.4,0.0,0.0\n4.0,0,0,0\n"


def config(path: Path | str, **keys: float) -> Config:
    given = {name.replace("__", "."): value for name, value in keys.items()}
    return load(None, {"reference.trace": str(path)} | given)


def traced(path: Path | str, **keys: float) -> Trace:
    found = trace_of(config(path, **keys))
    assert found is not None
    return found


@pytest.fixture
def good(tmp_path: Path) -> Path:
    path = tmp_path / "trace.csv"
    path.write_text(GOOD.partition("\n")[2], encoding="utf-8-sig")  # as spreadsheets write it
    return path


def test_samples_are_joined_by_lines_and_begin_again_at_the_end(good: Path) -> None:
    trace = traced(good)
    assert trace.at(0.5) == pytest.approx((0.2, 0.05, -0.1))
    assert trace.at(1.0) == pytest.approx((0.4, 0.1, -0.2))
    assert trace.at(3.0) == pytest.approx((0.2, 0.0, 0.0))
    assert trace.at(4.5) == pytest.approx(trace.at(0.5))


def test_the_seed_says_where_it_begins_if_asked_to(good: Path) -> None:
    assert traced(good, world__seed=3).begin == 0.0
    begins = [traced(good, world__seed=s, reference__trace_shift=4.0).begin for s in range(30)]
    assert 0.0 <= min(begins) < 0.8
    assert 3.2 < max(begins) <= 4.0
    assert len(set(begins)) == 30
    again = traced(good, world__seed=2, reference__trace_shift=4.0)
    assert again.begin == begins[2]
    assert again.at(1.0) == pytest.approx(traced(good).at(1.0 + begins[2]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "nothing"),
        ("0,0,0,0\n1,0,0,0\n", "t,vx,vy,wz"),
        ("t,vx,vy,wz\n0,0,0,0\n", "at least two"),
        ("t,vx,vy,wz\n0,0,0,0\n1,0,0\n", "four numbers"),
        ("t,vx,vy,wz\n0,0,0,0\n0,0,0,0\n", "t rising"),
        ("t,vx,vy,wz\n0,0,0,0\n1,nan,0,0\n", "finite"),
        ("t,vx,vy,wz\n0,0,0,0\n1,0,0.9,0\n", "vy of 0 … 0.9"),
    ],
)
def test_what_is_no_trace_is_one_clear_error(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "trace.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=message) as caught:
        traced(path)
    assert caught.value.name == f"reference.trace {path}"
    path.unlink()
    with pytest.raises(ConfigError, match="No such file"):
        traced(path)


def test_a_configuration_holds_what_the_file_says_and_needs_it_no_more(good: Path) -> None:
    found = config(good)
    before = trace_of(found)
    good.unlink()
    assert found.reference.trace == "t,vx,vy,wz;0,0,0,0;1.0,0.4,0.1,-0.2;2.0,0.4,0.0,0.0;4.0,0,0,0"
    again = build(tomllib.loads(to_toml(found)))
    assert again == found
    after = trace_of(again)
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(np.c_[after.t, after.v], np.c_[before.t, before.v])


def test_a_path_in_a_configuration_from_elsewhere_is_not_opened(good: Path) -> None:
    foreign = Config(reference=ReferenceConfig(trace=str(good)))
    with pytest.raises(ConfigError, match="expected t,vx,vy,wz"):
        trace_of(foreign)
