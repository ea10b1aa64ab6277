"""Real walks, recorded over the bus, replayed to the byte; what is planted or lost is found."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from quadriga.agents.predictor.gates import load_checked as load_predictor
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.commands.parser import main
from quadriga.identification.predictors import ensure_predictor
from quadriga.replay import team_replay
from quadriga.replay.outcome import ReplayOutcome
from quadriga.replay.recorded_predictor import copy_predictor
from quadriga.replay.saved_qp import load as load_qp
from quadriga.replay.team_replay import replay
from quadriga.shared.config.load import load
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.messages import Command, Consumed, Measurement, Message, Plan, State
from quadriga.shared.recording.reader import Recording
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import QUADRIGA, Launch, process_table
from quadriga.what_if.what_if import Branch, WhatIf, answer_what_if
from tests.listening import WAIT
from tests.quadriga.replay.rewritten import planted_bit, rewritten, without
from tests.runtime.conftest import DATA, REAL_TIME, SPEED, in_slow_motion

pytestmark = pytest.mark.usefixtures("_compiled")

Disturb = Callable[[Launch, str], None]
SWING = 300  # the tick at which the first feet leave the ground


def walked(folder: Path, disturb: Disturb | None = None, **keys: Any) -> Path:
    """The recording of a walk of two robots with all processes."""
    given = {**DATA, "team.robots": 2, "bus.endpoint": free_endpoint(), "world.seed": 5}
    given |= {"runtime.check_cpu": False}
    given |= {name.replace("__", "."): value for name, value in keys.items()}
    config = load(None, given)
    predictor = ensure_predictor(config, Console(stderr=True))
    folder.mkdir()
    copy_predictor(predictor, folder)
    (folder / "config.toml").write_text(to_toml(config), encoding="utf-8")
    sha256 = predictor_sha256(load_predictor(predictor, config)[0])
    rows = process_table(config, folder, predictor, sha256)
    if config.world.mode == REAL_TIME:
        rows = tuple(in_slow_motion(row, SPEED) for row in rows)
    with Launch(rows, folder / "logs") as running:
        if disturb is not None:
            disturb(running, config.bus.endpoint)
        running.watch(lambda: False)
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def lockstep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return walked(tmp_path_factory.mktemp("lockstep") / "run", world__duration=1.0)


def sections(keys: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Values by section and key, of names `section__key`."""
    given: dict[str, dict[str, Any]] = {}
    for name, value in keys.items():
        section, _, key = name.partition("__")
        given.setdefault(section, {})[key] = value
    return given


def edited(lockstep: Path, folder: Path, *edits: Any, **keys: Any) -> Path:
    """The recording with something changed, beside its predictor."""
    shutil.copy(lockstep.parent / "predictor.npz", folder)
    return rewritten(lockstep, folder / "run.mcap", *edits, **keys)


def replayed(path: Path, *robots: str, **keys: Any) -> list[ReplayOutcome]:
    """Outcomes of a replay, `section__key` changed."""
    return replay(path, robots, sections(keys), None, None, Console(stderr=True))


def check_exact(path: Path, outcomes: list[ReplayOutcome], *, plans: bool = True) -> None:
    """Every recorded message of every robot is recomputed to the byte."""
    recording = Recording(path)
    assert [outcome.robot for outcome in outcomes] == ["r1", "r2"]
    for outcome in outcomes:
        verdict = outcome.verdict
        assert verdict.exact, (outcome.robot, verdict.first, verdict.missing)
        kinds: list[type[Message]] = [Command, Measurement, *([Plan] if plans else [])]
        for kind in kinds:
            recorded = len(list(recording.messages(kind, outcome.robot)))
            assert verdict.equal[kind.__name__.lower()] == recorded, kind
            assert recorded, kind
        assert not verdict.differing


def test_lock_step_is_replayed_to_the_byte(
    lockstep: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By processes side by side, and by one."""
    with monkeypatch.context() as patch:
        patch.setattr(team_replay, "_SMALL", 0)
        assert main(["replay", str(lockstep.parent), "--all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[:16] for line in lines] == ["r1: 1000 command", "r2: 1000 command"]
    assert all("measurements equal to the byte" in line for line in lines)
    assert not list(Recording(lockstep).messages(Consumed)), "nothing unusual happened"
    check_exact(lockstep, replayed(lockstep))


def test_the_qps_of_a_moment_are_saved(lockstep: Path, tmp_path: Path) -> None:
    arguments = ["replay", str(lockstep), "--robot", "r2", "--out", str(tmp_path)]
    assert main([*arguments, "--save-qp", "0.702"]) == 0
    found = {path.name: load_qp(path) for path in tmp_path.glob("*.npz")}
    # The planner's next step after 702 is that of 720.
    assert set(found) == {"replay-r2-702-command.npz", "replay-r2-720-plan.npz"}
    for qp in found.values():
        np.testing.assert_allclose(qp.solve(), qp.x, atol=1e-5)
    assert main([*arguments, "--save-qp", "7"]) == 2


def answered(path: Path, out: Path, *robots: str, **keys: Any) -> Branch:
    """What would have happened had `section__key` been changed from 0.6 s on."""
    question = WhatIf(path, 0.6, sections(keys), None, robots, out)
    return answer_what_if(question, Console(stderr=True))


def test_what_would_have_happened(lockstep: Path, tmp_path: Path) -> None:
    same = answered(lockstep, tmp_path)
    assert (same.equal, same.parted) == (2000, None)
    assert all(before == after for _, before, after in same.table.rows)
    pushed = answered(lockstep, tmp_path, world__push="r2:900:90:0.7:0.2")
    assert pushed.parted == 701, "the first state after the push's first tick"
    tilts = [row for row in pushed.table.rows if row[0] == "r2, tilt at most [rad]"]
    assert float(tilts[0][2]) > 2 * float(tilts[0][1])
    # The agent's command is another one at once; the motors are some ticks behind it.
    lower = answered(lockstep, tmp_path, "r1", controller__swing_height=0.02)
    assert lower.parted is not None
    assert 601 <= lower.parted <= 605
    assert lower.equal == 2 * lower.parted, "all of both robots before, none after"
    assert pushed.figure.stat().st_size > 10_000


def test_what_cannot_be_asked_of_a_walk(lockstep: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"another walk: tick 0, .*up to 0\.6 s"):
        answered(lockstep, tmp_path, world__seed=6)
    with pytest.raises(ConfigError, match="--robot: got 'r3', expected one of r1, r2"):
        answered(lockstep, tmp_path, "r3")
    with pytest.raises(ConfigError, match=r"team: got team\.robots 2 → 3"):
        answered(lockstep, tmp_path, team__robots=3)
    with pytest.raises(ConfigError, match=r"planner\.kind: got 'centralised'"):
        answered(lockstep, tmp_path, planner__kind="centralised")
    late = WhatIf(lockstep, 1.5, {}, None, (), tmp_path)
    with pytest.raises(ConfigError, match=r"--from: got 1\.5 s, expected a time up to 0\.99 s"):
        answer_what_if(late, Console(stderr=True))


def test_a_planted_bit_in_a_state_is_found_at_its_tick(
    lockstep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = edited(lockstep, tmp_path, planted_bit("team/r2/state", 702, "v_joint"))
    assert main(["replay", str(run), "--robot", "r1"]) == 0, "no input of r1"
    capsys.readouterr()
    assert main(["replay", str(run), "--robot", "r2"]) == 1
    output = capsys.readouterr().out
    assert "first difference: tick 702, command.tau[" in output
    assert "inputs there: state of tick 702; mode walk" in output
    saved = tmp_path / "replay-r2-702-command.npz"
    qp = load_qp(saved)
    np.testing.assert_allclose(qp.solve(), qp.x, atol=1e-6)
    alone = [sys.executable, "-m", "quadriga.replay.saved_qp", str(saved)]
    done = subprocess.run(alone, capture_output=True, text=True, check=True)
    assert "whole-body QP of r2 at tick 702" in done.stdout


def test_a_planted_bit_in_a_peer_s_measurement_is_found_in_the_next_plan(
    lockstep: Path, tmp_path: Path
) -> None:
    run = edited(lockstep, tmp_path, planted_bit("team/r1/measurement", 630, "y"))
    (outcome,) = replayed(run, "r2")
    first = outcome.verdict.first
    assert first is not None
    # Taken in at 660 with the samples up to 640, and used by the plan of step 17.
    assert (first.tick, first.name) == (680, "plan")
    (saved,) = outcome.files
    qp = load_qp(saved)
    assert saved.name == "replay-r2-680-plan.npz"
    np.testing.assert_allclose(qp.solve(), qp.x, atol=1e-5)


def test_a_changed_key_is_found_at_the_first_tick_it_acts(lockstep: Path, tmp_path: Path) -> None:
    run = edited(lockstep, tmp_path, config={"controller.swing_height": 0.1})
    for outcome in replayed(run):
        first = outcome.verdict.first
        assert first is not None
        assert (first.tick, first.name) == (SWING, "command")
        assert outcome.failed


def test_a_change_is_drawn_instead_of_failing(
    lockstep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--robot", "r2", "--set", "planner.R=[0.1,0.1,0.1]", "--out", str(tmp_path)]
    assert main(["replay", str(lockstep), *options]) == 0
    output = capsys.readouterr().out
    assert "changed: planner.R (0.2, 0.2, 0.05) → (0.1, 0.1, 0.1)" in output
    assert "first difference: tick 320, plan.u[" in output
    assert (tmp_path / "replay-r2.png").stat().st_size > 20_000
    # A value that is the recorded one is no change.
    assert main(["replay", str(lockstep), "--robot", "r2", "--set", "planner.N=25"]) == 0
    assert "changed" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("key", "made", "status", "told"),
    [
        ("r2/state", 500, 1, "state of r2 at tick 500 (tick 500)"),
        ("r1/plan", 480, 1, "plan:r1:12.0 (tick 500)"),
        ("r1/measurement", 470, 1, "measurement:r1:470 (tick 500)"),
        ("reference", 600, 1, "reference:operator:600 (tick 600)"),
        ("r2/command", 500, 0, "equal to the byte; 1 command not in the recording; 1.0 s in"),
    ],
)
def test_a_message_the_recorder_lost_is_named(
    lockstep: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    key: str,
    made: int,
    status: int,
    told: str,
) -> None:
    """A lost input ends the comparison; a lost output is counted, and the rest is equal."""
    run = edited(lockstep, tmp_path, without(f"team/{key}", made))
    assert main(["replay", str(run), "--robot", "r2"]) == status
    text = f"input missing from the recording: {told}" if status else told
    assert text in capsys.readouterr().out


def test_the_debugger_stops_with_the_agent_in_scope(lockstep: Path) -> None:
    command = (*QUADRIGA, "replay", str(lockstep), "--robot", "r1", "--break", "0.6")
    run = partial(subprocess.run, command, capture_output=True, text=True, timeout=WAIT)
    done = run(input="p 'ticks', memory.tick, inputs.state.tick, recorded['command'].tick\nc\n")
    assert "('ticks', 599, 600, 600)" in done.stdout
    assert "measurements equal to the byte" in done.stdout
    done = run(input="q\n")
    assert (done.returncode, done.stderr) == (130, "quadriga: interrupted\n")


def check_exact_up_to_a_loss(path: Path, outcome: ReplayOutcome) -> None:
    """All that was said before the recorder lost an input, if it did, is recomputed to the byte."""
    recording, verdict = Recording(path), outcome.verdict
    assert verdict.first is None
    assert not verdict.differing
    for kind in (Command, Measurement, Plan):
        output = [m for m in recording.messages(kind, outcome.robot) if m.tick <= verdict.last]
        assert verdict.equal[kind.__name__.lower()] == len(output)
    for _, name in verdict.missing:
        tick = int(name.rpartition("tick ")[2]) if name.startswith("state of") else None
        assert tick not in {m.tick for m in recording.messages(State, outcome.robot)}


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
def test_real_time_is_replayed_to_the_byte(tmp_path: Path) -> None:
    for attempt in range(5):  # on a busy machine links drop messages, and robots pass over states
        run = walked(tmp_path / str(attempt), world__mode="realtime", world__duration=1.5)
        outcomes = replayed(run)
        for outcome in outcomes:
            check_exact_up_to_a_loss(run, outcome)
        if all(len(outcome.verdict.equal) == 3 and outcome.verdict.exact for outcome in outcomes):
            break
    else:
        pytest.fail("no recording without a loss")
    assert [outcome.robot for outcome in outcomes] == ["r1", "r2"]
    assert all(outcome.verdict.equal["command"] > 300 for outcome in outcomes)
    assert list(Recording(run).messages(Consumed, "r1")), "it tells what it took in"


@pytest.mark.nightly
@pytest.mark.usefixtures("_realtime")
def test_what_was_taken_in_in_real_time_cannot_be_guessed(tmp_path: Path) -> None:
    for attempt in range(5):
        run = walked(tmp_path / str(attempt), world__mode="realtime", world__duration=0.5)
        before, lost, after = list(Recording(run).messages(Consumed, "r1"))[:3]
        path = rewritten(run, run.parent / "lost.mcap", without("team/r1/inputs", lost.tick))
        (outcome,) = replayed(path, "r1")
        tick, name = outcome.verdict.missing[0]
        if tick > before.tick:  # else a busy recorder had lost something before
            break
    count = after.number - before.number - 1
    assert tick == before.tick + 1
    assert name == f"{count} of inputs of r1 between ticks {before.tick} and {after.tick}"


def test_the_plans_of_a_central_planner_are_inputs(tmp_path: Path) -> None:
    run = walked(tmp_path / "run", world__duration=0.7, planner__kind="centralised")
    outcomes = replayed(run)
    check_exact(run, outcomes, plans=False)
    assert not outcomes[0].verdict.equal["plan"]
    edit = planted_bit("team/r2/plan", 480, "u")
    (outcome,) = replayed(rewritten(run, tmp_path / "planted.mcap", edit), "r2")
    assert outcome.verdict.first is not None
    assert outcome.verdict.first.tick == 488  # a plan arrives 8 ms after its data
