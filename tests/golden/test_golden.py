"""The golden walk is walked again by the present code: a change of behaviour must be stated."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quadriga.agents.predictor.gates import load_checked
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, Message, State
from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.runtime.arithmetic import arithmetic
from tests.golden import scenario
from tests.golden.compare import REMEDY, TOLERANCE, differences, first_difference, judge
from tests.golden.renew import ARITHMETIC, note, write
from tests.golden.rerun import recorded, rerun

CONFIG = scenario.config()
ROBOTS = ("r1", "r2")
Sent = list[tuple[str, bytes]]


@pytest.fixture(scope="module")
def entries() -> list[ChunkEntry]:
    return list(Recording(scenario.RECORDING).entries())


def heard_again(entries: list[ChunkEntry], robot: str, config: Config = CONFIG) -> Sent:
    return rerun(entries, config, robot, load_checked(scenario.PREDICTOR, CONFIG)[0])


@pytest.mark.parametrize("robot", ROBOTS)
def test_agents_do_what_they_did(
    entries: list[ChunkEntry], robot: str, record_property: Callable[[str, object], None]
) -> None:
    made_by = json.loads(Recording(scenario.RECORDING).metadata[ARITHMETIC])
    verdict = judge(
        robot,
        recorded(entries, CONFIG, robot),
        heard_again(entries, robot),
        differences(arithmetic(), made_by),
    )
    assert verdict.ok, f"\n{verdict.text}"
    record_property("golden", verdict.text)


def test_the_golden_walk_is_worth_repeating(entries: list[ChunkEntry]) -> None:
    for robot in ROBOTS:
        kinds = [key.rpartition("/")[2] for key, _ in recorded(entries, CONFIG, robot)]
        assert [kinds.count(kind) for kind in ("command", "measurement", "plan")] == [600, 59, 12]
    files = (scenario.RECORDING, scenario.PREDICTOR)
    assert sum(path.stat().st_size for path in files) < 400_000


def changed(
    entries: list[ChunkEntry], key: str, tick: int, change: Callable[[State], Message]
) -> list[ChunkEntry]:
    """The same recording with one other message."""
    return [
        entry._replace(payload=encode(change(decode(entry.payload, State))))
        if (entry.key, entry.tick) == (key, tick)
        else entry
        for entry in entries
    ]


def flip_last_bit(state: State) -> State:
    bits = state.v_joint.copy().view(np.int64)
    bits[4] ^= 1
    return replace(state, v_joint=bits.view(np.float64))


def test_one_bit_of_one_sensor_is_found_at_its_tick(entries: list[ChunkEntry]) -> None:
    before = heard_again(entries, "r2")
    after = heard_again(changed(entries, "team/r2/state", 433, flip_last_bit), "r2")
    found = first_difference(before, after)
    assert found is not None
    assert (found.tick, found.name) == (433, "team/r2/command")
    assert found.field.startswith("tau[")
    assert heard_again(entries, "r2") == before, "nothing is remembered from one run to the next"


def test_a_changed_gain_is_a_change_of_behaviour(entries: list[ChunkEntry]) -> None:
    stiffer = replace(CONFIG, controller=replace(CONFIG.controller, kp_z=400.1))
    verdict = judge("r1", heard_again(entries, "r1"), heard_again(entries, "r1", stiffer), ())
    assert not verdict.ok
    assert "First difference: tick 0, team/r1/command.tau[" in verdict.text
    assert REMEDY in verdict.text


def test_what_another_machine_may_do_to_the_last_bits_is_let_through_and_told() -> None:
    def command(torque: float) -> Sent:
        zero, tau = np.zeros(12), np.full(12, 2.0)
        tau[3] = torque
        return [("team/r1/command", encode(Command(7, 7_000_000, tau, zero, zero, zero, zero)))]

    near, far = command(2.0 + TOLERANCE), command(2.0 + 3.0 * TOLERANCE)
    assert not judge("r1", command(2.0), near, []).ok, "one machine, one result"
    verdict = judge("r1", command(2.0), near, ["BLAS 'Zen' instead of 'SkylakeX'"])
    assert verdict.ok
    assert "not to the byte" in verdict.text
    assert "Zen" in verdict.text
    beyond = judge("r1", command(2.0), far, ["BLAS 'Zen' instead of 'SkylakeX'"])
    assert not beyond.ok
    assert "tick 7, team/r1/command.tau[3]: recorded 2.0, recomputed 2.00000" in beyond.text
    assert not judge("r1", command(2.0), [], ["BLAS 'Zen' instead of 'SkylakeX'"]).ok


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names a kernel of x86")
def test_on_a_processor_of_2008_the_walk_is_the_same_within_the_tolerance() -> None:
    options = ("-q", "-p", "no:cacheprovider", "-k", "do_what")
    command = [sys.executable, "-m", "pytest", *options, __file__]
    environment = {**os.environ, "OPENBLAS_CORETYPE": "Nehalem"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("not to the byte") == 2
    assert "Nehalem' instead of" in done.stdout


def test_renewing_gives_the_same_file_and_keeps_every_reason(tmp_path: Path) -> None:
    predictor, _ = load_checked(scenario.PREDICTOR, CONFIG)
    for name in ("first", "second"):
        write(tmp_path / name, CONFIG, predictor)
    assert (tmp_path / "first").read_bytes() == (tmp_path / "second").read_bytes()
    reasons = tmp_path / "REASONS.md"
    reasons.write_text("- 2026-01-01: the first\n", encoding="utf-8")
    note(reasons, "the second")
    first, second = reasons.read_text(encoding="utf-8").splitlines()
    assert first == "- 2026-01-01: the first"
    assert second.endswith(": the second")
    assert scenario.REASONS.read_text(encoding="utf-8").count("\n- 20") >= 1


def test_a_renewal_without_a_reason_is_refused() -> None:
    command = [sys.executable, "-m", "tests.golden.renew"]
    for arguments in ([], ["--reason", "  "]):
        done = subprocess.run([*command, *arguments], capture_output=True, text=True, timeout=120)
        assert done.returncode == 2
        assert "--reason" in done.stderr
