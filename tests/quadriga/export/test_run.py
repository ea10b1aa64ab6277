"""What can go wrong with an export is one line, and leaves nothing half-written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.commands.parser import build_parser, main
from quadriga.export import csv_files
from quadriga.export.columns import TickReached
from quadriga.export.run import FORMATS
from quadriga.export.source import Source
from quadriga.recordings.metadata import build_metadata
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Event
from quadriga.shared.recording.writer import RecordingWriter

SMALL = """
import resource, signal, sys
from quadriga.commands.parser import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, -1))
sys.exit(main(sys.argv[1:]))
"""


def failed(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    status = main(["export", *map(str, arguments)])
    out, err = capsys.readouterr()
    assert (status, out, err.count("\n")) == (2, "", 1)
    return err


def test_mistakes(capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path) -> None:
    assert "No such file" in failed(capsys, tmp_path / "no.mcap", "--to", "csv")
    there = tmp_path / "there"
    there.write_text("precious")
    for form in FORMATS:
        assert "overwrites nothing" in failed(capsys, file, "--to", form, "-o", there)
        assert there.read_text() == "precious"
        below = there / "out"
        output = failed(capsys, file, "--to", form, "-o", below)
        assert f"--output: got {below}: Not a directory" in output
    assert "got --robots" in failed(capsys, file, "--to", "csv", "--robots", "3")
    empty = tmp_path / "empty.mcap"
    with RecordingWriter(empty, build_metadata(Config(), "")):
        pass
    assert "no message of a known topic" in failed(capsys, empty, "--to", "parquet")
    assert not (tmp_path / "empty-parquet").exists()


@pytest.mark.parametrize(
    ("form", "package", "extra"),
    [
        ("foxglove", "foxglove", "export"),
        ("foxglove", "google", "export"),
        ("rerun", "rerun", "rerun"),
        ("parquet", "pyarrow", "export"),
    ],
)
def test_a_package_that_is_not_installed_is_named_with_its_remedy(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    file: Path,
    tmp_path: Path,
    form: str,
    package: str,
    extra: str,
) -> None:
    for name in list(sys.modules):
        if name.partition(".")[0] == package or name.startswith("quadriga.export."):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    output = failed(capsys, file, "--to", form, "-o", tmp_path / "out")
    assert f"--to {form}: got no Python package {package}" in output
    assert f"pip install -e '.[{extra}]'" in output


@pytest.mark.parametrize("form", ["foxglove", "rerun", "csv", "parquet"])
def test_a_full_disk_is_one_clear_error_and_leaves_nothing(
    file: Path, tmp_path: Path, form: str
) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-c", SMALL, "export", str(file), "--to", form, "-o", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "expected a writable place with room" in done.stderr
    assert not out.exists()


def test_without_an_output_it_goes_beside_the_recording(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path
) -> None:
    cut = tmp_path / "run.mcap"
    cut.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    assert main(["export", str(cut), "--to", "csv"]) == 2
    output = capsys.readouterr().out
    assert output.startswith(str(tmp_path / "run-csv"))
    assert "only as far as the recording goes: the file ends at byte" in output
    assert (tmp_path / "run-csv" / "r1.state.csv").stat().st_size > 1000


def test_the_command_line_offers_every_format() -> None:
    for form in FORMATS:
        assert build_parser().parse_args(["export", "f", "--to", form]).to == form


def test_what_somebody_else_writes_meanwhile_is_neither_mixed_nor_removed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    mine = csv_files.write_csv

    def meanwhile(source: Source, to: Path, progress: TickReached) -> tuple[Path, ...]:
        out.mkdir()
        (out / "theirs").write_text("precious")
        return mine(source, to, progress)

    monkeypatch.setattr(csv_files, "write_csv", meanwhile)
    assert "exists by now" in failed(capsys, file, "--to", "csv", "-o", out)
    assert [path.name for path in tmp_path.glob("*out*")] == ["out"]
    assert (out / "theirs").read_text() == "precious"


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_key_that_no_file_can_be_called_by_gets_one_all_the_same(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, form: str
) -> None:
    path, out = tmp_path / "run.mcap", tmp_path / "out"
    with RecordingWriter(path, build_metadata(Config(), "")) as writer:
        for robot in ("r1", "x" * 600, "x" * 601, "r\0", "r."):
            writer.write(f"team/{robot}/event", encode(Event(1, 1, "fall", "r1", "", "fall")), 1)
    assert main(["export", str(path), "--to", form, "-o", str(out)]) == 0
    assert len(list(out.iterdir())) == 5
    assert (out / f"r1.event.{form}").is_file()
