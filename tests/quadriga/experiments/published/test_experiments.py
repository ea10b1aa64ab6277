"""Experiments as they are typed: real walks, the same command again, Ctrl-C, and mistakes."""

from __future__ import annotations

import gzip
import signal
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from tests.quadriga.experiments.processes import await_gone, await_true, children, finished, start
from tests.quadriga.experiments.published.made import checkout

Said = pytest.CaptureFixture[str]


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    """One robot on small boxes for a second, and one with softer gains."""
    (tmp_path / "steps.toml").write_text(
        '[team]\nrobots = 1\n[world]\nterrain = "boxes"\nterrain_height = 0.03\nduration = 1.0\n',
        encoding="utf-8",
    )
    path = tmp_path / "tiny.toml"
    path.write_text(
        f'title = "Tiny"\nquestion = "Does it stand?"\nscenarios = ["{tmp_path}/steps.toml"]\n'
        'planners = ["none"]\nseeds = "0:2"\n'
        '[variants.soft]\nplanner.kind = "none"\ncontroller.kp_tilt = 500.0\n'
        '[[requirements]]\nmeasure = "success"\nleast = 97\n',
        encoding="utf-8",
    )
    return path


def test_walked_published_and_gone_on_with(capsys: Said, experiment: Path, tmp_path: Path) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    words = ["experiments", str(experiment), "--into", str(into), "--out", str(runs)]
    page = into / "docs" / "results.md"
    assert main([*words, "--jobs", "1"]) == 0
    output = capsys.readouterr()
    assert "soft: success ≥ 97 %" in output.out
    assert output.out.endswith(f"{page}\n")
    text = page.read_text(encoding="utf-8")
    assert "4\N{NO-BREAK SPACE}of\N{NO-BREAK SPACE}4" in text
    assert str(tmp_path) not in text
    assert (runs / "tiny" / "report.html").is_file()
    assert len(finished(runs / "tiny")) == 4
    assert main([*words, "--only-publish"]) == 0
    assert page.read_text(encoding="utf-8") == text
    elsewhere = ["--out", str(tmp_path / "elsewhere"), "--from-published", "--jobs", "1"]
    assert main([*words, *elsewhere]) == 0, "all walked and published"
    again = finished(tmp_path / "elsewhere" / "tiny")
    assert set(again) == set(finished(runs / "tiny")), "nothing is walked twice"
    assert "tiny: 4 published trials taken up" in capsys.readouterr().err
    assert page.read_text(encoding="utf-8") == text
    first = (into / "docs/results/trials/tiny/trials.csv.gz").read_bytes()
    assert str(tmp_path).encode() not in gzip.decompress(first)
    manifest = runs / "tiny" / "campaign.json"
    manifest.write_text(
        manifest.read_text(encoding="utf-8").replace("quadriga 0", "quadriga 9"), encoding="utf-8"
    )
    capsys.readouterr()
    assert main([*words, "--jobs", "1"]) == 2, "trials of other code"
    assert "use a new folder" in capsys.readouterr().err
    for packed in (into / "docs/results/trials/tiny").iterdir():
        body = gzip.decompress(packed.read_bytes()).replace(b"quadriga 0", b"quadriga 9")
        packed.write_bytes(gzip.compress(body))
    anew = ["--out", str(tmp_path / "anew"), "--from-published", "--jobs", "1"]
    assert main([*words, *anew]) == 2, "published trials of other code"
    complaint = capsys.readouterr().err
    assert "--from-published: tiny: got trials with code and versions" in complaint
    assert "without the option all is walked anew" in complaint
    assert not (tmp_path / "anew").exists()


def test_a_look_is_shown_and_not_published(capsys: Said, experiment: Path, tmp_path: Path) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    words = ["experiments", str(experiment), "--into", str(into), "--out", str(runs)]
    assert main([*words, "--jobs", "1", "--seeds", "7"]) == 0, capsys.readouterr().err
    assert "Tiny: Walks" in capsys.readouterr().out
    assert len(finished(runs / "looks" / "tiny")) == 2
    assert [path.name for path in into.rglob("*")] == ["docs"]
    assert not (runs / "tiny").exists()
    assert main([*words, "--jobs", "1", "--seeds", "7", "--require"]) == 0, "all is met"
    text = experiment.read_text(encoding="utf-8")
    strict = text.replace('"success"\nleast = 97', '"max-roll"\nmost = 0')
    experiment.write_text(strict, encoding="utf-8")
    assert main([*words, "--jobs", "1", "--seeds", "7"]) == 0
    assert main([*words, "--jobs", "1", "--seeds", "7", "--require"]) == 1
    assert "open" in capsys.readouterr().out, "nobody walked steadily"
    experiment.write_text(f"{strict}moonshot = true\n", encoding="utf-8")
    assert main([*words, "--jobs", "1", "--seeds", "7", "--require"]) == 0, "it is hoped for"


def test_ctrl_c_stops_at_once_and_keeps_what_is_done(experiment: Path, tmp_path: Path) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    process = start(
        "--seeds",
        "0:200",
        "--jobs",
        "1",
        "--into",
        str(into),
        "--out",
        str(runs),
        str(experiment),
        verb="experiments",
    )
    await_true(lambda: len(finished(runs / "looks" / "tiny")) >= 1, process)
    workers = children(process.pid)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=300.0)
    assert process.returncode == 130, output
    assert "Traceback" not in output
    await_gone(workers)
    assert 1 <= len(finished(runs / "looks" / "tiny")) < 400


def test_a_mistake_costs_one_line(capsys: Said, experiment: Path, tmp_path: Path) -> None:
    into, runs = checkout(tmp_path / "here"), tmp_path / "runs"
    where = ["--into", str(into), "--out", str(runs)]
    broken = tmp_path / "broken.toml"
    broken.write_text("title = ", encoding="utf-8")
    unknown = tmp_path / "unknown.toml"
    unknown.write_text(
        experiment.read_text(encoding="utf-8").replace("kp_tilt", "kp_tlit"), encoding="utf-8"
    )
    bare = tmp_path / "bare"
    bare.mkdir()
    name = str(experiment)
    for words, message in (
        (["papers", *where], "experiments: got 'papers'"),
        ([str(broken), *where], "broken.toml"),
        ([str(unknown), *where], "did you mean 'controller.kp_tilt'"),
        ([name, "--into", str(bare)], "bare/docs: got no such folder"),
        ([name, *where, "--seeds", "x"], "--seeds: got 'x'"),
        ([name, *where, "--seeds", "0", "--only-publish"], "walks nothing"),
        ([name, *where, "--seeds", "0", "--from-published"], "--from-published: got"),
        ([name, *where, "--vx", "0.3"], "got --vx, expected an option that it has"),
        ([name, *where, "--scenario", "flat"], "got --scenario, expected an option"),
        ([name, *where, "--dask", "paper"], "--dask: got 'paper'"),
    ):
        assert main(["experiments", *words]) == 2
        output = capsys.readouterr().err
        assert message in output
        assert output.count("\n") == 1
    assert not runs.exists()
