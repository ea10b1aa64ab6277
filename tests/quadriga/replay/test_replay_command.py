"""Mistakes about a replay cost one clear line each; what it needs is found where it is kept."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import predictor_sha256, save
from quadriga.commands.parser import main
from quadriga.recordings.metadata import build_metadata
from quadriga.replay.outcome import format_outcome
from quadriga.replay.recorded_predictor import PREDICTOR, copy_predictor, find_predictor
from quadriga.replay.saved_qp import SavedQp
from quadriga.replay.saved_qp import load as load_qp
from quadriga.replay.saved_qp import save as save_qp
from quadriga.replay.team_replay import replay
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, RecordingError
from quadriga.shared.messages import Command, Reference
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from tests.a1 import standing
from tests.plugins.kinds import install_module
from tests.quadriga.replay.rewritten import rewritten


def configured(**keys: object) -> Config:
    """A configuration of one robot."""
    given = {name.replace("__", "."): value for name, value in keys.items()}
    return load(None, {"team.robots": 1, "planner.kind": "none", **given})


def write(path: Path, config: Config, sha256: str = "", ticks: int = 5) -> Path:
    """A recording of a robot that stands for some ticks with torques that no agent gave."""
    zero = np.zeros(12)
    with RecordingWriter(path, build_metadata(config, sha256)) as to:
        to.write("team/reference", encode(Reference(0, 0, 0.0, 0.0, 0.0, 0.26)), 0)
        for tick in range(ticks):
            command = Command(tick, 10**6 * tick, zero, zero, zero, zero, zero)
            to.write("team/r1/state", encode(standing(tick)), tick)
            to.write("team/r1/command", encode(command), tick)
    return path


def fitted(path: Path, config: Config, scale: float = 0.0) -> str:
    """Write a predictor file; its digest."""
    meta = PredictorMeta.of(config)
    G = np.full((1, 1, 1, 6 * meta.N, meta.layout.width), scale)
    return save(path, Predictor(meta, G))


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return write(tmp_path / "run.mcap", configured())


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def complaint(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """What a wrong command says: one line, exit status 2."""
    assert main(["replay", *map(str, arguments)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


def test_mistakes_on_the_command_line(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, output in (
        ((run, "--robot", "r2"), "--robot: got 'r2', expected one of r1"),
        ((run.parent / "no.mcap", "--all"), "no.mcap: got No such file"),
        ((run,), "replay: got nothing to run again, expected --robot NAME, --all, --world or --"),
        ((run, "--all", "--break", "1"), "--break: got --all, expected --robot NAME"),
        ((run, "--robot", "r1", "--break", "nan"), "--break: got nan, expected a time [s]"),
        ((run, "--robot", "r1", "--break", "9"), "--break: got 9 s, expected a time up to 0.004 s"),
        ((run, "--all", "--set", "controller.kp_swng=1"), "did you mean 'controller.kp_swing'?"),
        ((run, "--all", "--set", "team.robots=2"), "team.robots: got 2, expected 1 as recorded"),
        ((run, "--all", "--set", "estimator.kind=truth"), "had not taken in the truth"),
        ((run, "--all", "--set", "planner.kind=deepc"), "no plans of such a planner"),
        ((run, "--all", "--predictor", run), "expected agents that plan for themselves"),
        ((run, "--all", "--out", run), "--out"),
    ):
        assert output in complaint(capsys, *arguments), output


def test_a_recording_of_another_version(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    future = rewritten(run, tmp_path / "future.mcap", config={"controller.kp_tail": 3.0})
    output = complaint(capsys, future, "--all")
    assert "configuration of " in output
    assert "controller.kp_tail" in output
    assert "recorded by another version of quadriga: use that one" in output
    nothing = rewritten(run, tmp_path / "nothing.mcap", metadata={"config_json": ""})
    assert "metadata without a configuration" in complaint(capsys, nothing, "--all")


def test_recordings_that_lack_what_a_replay_needs(
    tmp_path: Path, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    realtime = write(tmp_path / "real.mcap", configured(world__mode="realtime"))
    assert "no message on team/r1/inputs" in complaint(capsys, realtime, "--all")
    silent = rewritten(run, tmp_path / "silent.mcap", lambda entry: None)
    assert "no states of r1" in complaint(capsys, silent, "--all")
    late = rewritten(run, tmp_path / "late.mcap", lambda e: e.payload if e.tick > 1 else None)
    assert main(["replay", str(late), "--all"]) == 1
    output = capsys.readouterr().out
    assert "input missing from the recording: reference:operator:0 (tick 0); state of r1" in output


def test_a_stop_that_could_not_be_read_is_handed_over_where_it_was_taken_in(tmp_path: Path) -> None:
    run, config = tmp_path / "run.mcap", configured()
    agent = Agent(config, "r1", None)
    arrivals = Inbox(config, "r1", agent.peers)
    memory = agent.initial()
    with RecordingWriter(run, build_metadata(config, "")) as to:
        for tick in range(5):
            reference = encode(Reference(0, 0, 0.0, 0.0, 0.0, 0.26))
            if tick == 0:
                arrivals.take("team/reference", reference)
                to.write("team/reference", reference, 0)
            if tick == 3:
                arrivals.take("team/estop", b"stop!")
                to.write("team/estop", b"stop!", 3)
            inputs = arrivals.pop_inputs(standing(tick), awaited := agent.expected(tick))
            if record := arrivals.record(tick - 1, inputs, awaited):
                to.write("team/r1/inputs", encode(record), tick)
            memory, outputs = agent.step(memory, inputs)
            to.write("team/r1/state", encode(standing(tick)), tick)
            to.write("team/r1/command", encode(outputs.command), tick)
    assert outputs.reason == "estop:unreadable"
    (outcome,) = replay(run, (), {}, None, None, Console())
    assert outcome.verdict.exact
    assert outcome.verdict.equal["command"] == 5


COUNTING = """
from quadriga.agents.planning.interface import PlanningInterface, PlanningOutputs
from quadriga.agents.planning.active_plan import PlanCheck
from quadriga.shared.planner_kinds import PlannerKind
from quadriga.shared.messages import Plan
import numpy as np

KIND = PlannerKind("counting", "t", "quadriga_counting_module:Counting", needs_predictor=False,
                   needs_data=True, options={"hidden": 0})


class Counting(PlanningInterface):
    def __init__(self, config, index, predictor, clock_ns, collected):
        self.config, self.count = config, 0
        self.nominal = PlanCheck(config, index).nominal
        assert callable(collected)

    def initial(self):
        return 0

    def step(self, count, inputs):
        self.count, tick = self.count + 1, inputs.tick
        shown = self.count if self.config.planner.option_values["hidden"] else count + 1
        if tick % 40:
            return count + 1, PlanningOutputs()
        u = self.nominal(tick)
        y = np.zeros((len(u), 6))
        return count + 1, PlanningOutputs(Plan(tick, 0, tick // 40, u, y, str(shown), {}, 0))
"""


@pytest.mark.parametrize("hidden", [0, 1])
def test_a_planner_that_keeps_state_in_its_instance_is_found_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hidden: int
) -> None:
    install_module(tmp_path, monkeypatch, "counting", COUNTING)
    options = {"planner__kind": "counting", "planner__options": f"hidden={hidden}"}
    run, config = tmp_path / "run.mcap", configured(**options)
    agent = Agent(config, "r1", None, collected=list)
    arrivals = Inbox(config, "r1", ())
    memory = agent.initial()
    with RecordingWriter(run, build_metadata(config, "")) as to:
        for tick in range(200):
            inputs = arrivals.pop_inputs(standing(tick), awaited := agent.expected(tick))
            if record := arrivals.record(tick - 1, inputs, awaited):
                to.write("team/r1/inputs", encode(record), tick)
            memory, outputs = agent.step(memory, inputs)
            to.write("team/r1/state", encode(standing(tick)), tick)
            to.write("team/r1/command", encode(outputs.command), tick)
            if outputs.plan is not None:
                to.write("team/r1/plan", encode(outputs.plan), tick)
    (outcome,) = replay(run, (), {}, None, None, Console())
    assert outcome.verdict.exact is not bool(hidden)
    assert outcome.stateful is bool(hidden)
    if hidden:
        assert outcome.verdict.first is not None
        assert outcome.verdict.first.tick == 120  # the first plan after the middle
        assert outcome.verdict.equal["plan"] == 3
        assert "keeps state outside" in format_outcome(outcome)


def test_a_cut_recording_is_replayed_up_to_the_cut_and_said_to_be_cut(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write(tmp_path / "run.mcap", configured(), ticks=2000)
    content = run.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    assert main(["replay", str(cut), "--all"]) == 2
    out, err = capsys.readouterr()
    assert "commands differ" in out
    assert err.count("\n") == 1
    assert "cut.mcap: got a file that is cut after" in err
    assert "`quadriga recover`" in err


def test_a_false_command_is_told_with_its_values(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(run), "--robot", "r1"]) == 1
    output = capsys.readouterr().out
    assert "r1: 5 of 5 commands differ; " in output
    assert "first difference: tick 0, command.tau[0]: recorded 0.0, recomputed " in output
    assert "inputs there: state of tick 0; reference of operator: 0; mode stand" in output
    assert "replay-r1-0-command.npz" in output
    assert "missing" not in output


def test_the_predictor_is_found_by_its_digest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = configured(planner__kind="distributed")
    own, other = tmp_path / "own.npz", tmp_path / "other.npz"
    sha256, _ = fitted(own, config), fitted(other, config, 0.1)
    recording = Recording(write(tmp_path / "run.mcap", config, sha256))
    output = complaint(capsys, recording.path, "--all")
    assert f"digest {sha256[:16]}" in output
    assert "--predictor FILE" in output
    assert find_predictor(recording, config, own)[1]
    assert not find_predictor(recording, config, other)[1]
    with pytest.raises(PredictorError, match="no such file"):
        find_predictor(recording, config, tmp_path / "none.npz")
    copy_predictor(other, tmp_path)  # another one beside the recording is not taken for it
    cached = tmp_path / "cache" / "quadriga" / "predictor-0.npz"
    cached.parent.mkdir(parents=True)
    cached.write_bytes(own.read_bytes())
    found, same = find_predictor(recording, config, None)
    assert found is not None
    assert (predictor_sha256(found), same) == (sha256, True)
    cached.unlink()
    copy_predictor(own, tmp_path)
    assert find_predictor(recording, config, None)[1]


def test_a_kept_predictor_is_a_copy_that_may_be_changed(tmp_path: Path) -> None:
    source, run_dir = tmp_path / "source.npz", tmp_path / "run"
    source.write_bytes(b"predictor")
    run_dir.mkdir()

    copy_predictor(source, run_dir)
    assert (run_dir / PREDICTOR).read_bytes() == b"predictor"
    (run_dir / PREDICTOR).write_bytes(b"another")
    assert source.read_bytes() == b"predictor"
    copy_predictor(source, run_dir)
    assert (run_dir / PREDICTOR).read_bytes() == b"predictor"
    with pytest.raises(RecordingError, match="room for the predictor"):
        copy_predictor(source, tmp_path / "nowhere")


def test_a_saved_problem_can_be_solved_on_its_own(tmp_path: Path) -> None:
    # min ½ |x|² − x₁ − x₂ with x₁ ≤ 0.25 and x₁ + x₂ ≤ 1: at (0.25, 0.75).
    far = np.array([1e30, 1e30])
    lower, upper = np.append(-far, -1e30), np.array([0.25, 1e30, 1.0])
    qp = SavedQp(np.eye(2), -np.ones(2), np.ones((1, 2)), lower, upper, np.zeros(2), "an example")
    save_qp(tmp_path / "qp.npz", qp)
    np.testing.assert_allclose(load_qp(tmp_path / "qp.npz").solve(), [0.25, 0.75])
    (tmp_path / "bad.npz").write_bytes(b"nothing")
    (tmp_path / "cut.npz").write_bytes((tmp_path / "qp.npz").read_bytes()[:-40])
    np.save(tmp_path / "array.npy", np.eye(2))
    for name in ("bad.npz", "none.npz", "cut.npz", "array.npy"):
        with pytest.raises(RecordingError):
            load_qp(tmp_path / name)


def test_an_error_survives_the_way_out_of_a_worker() -> None:
    error = RecordingError("run.mcap", "nothing", "something", "lost")
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again)) == (RecordingError, str(error))
