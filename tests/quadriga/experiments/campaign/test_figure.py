"""A campaign's figure in a file of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from quadriga.commands.parser import main
from quadriga.experiments.campaign.figure import write_figure
from quadriga.experiments.campaign.ledger import Ledger
from quadriga.experiments.campaign.report import read_report
from tests.quadriga.experiments.rows import manifest, row

BEGINS = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    swept = (("80",), ("120",))
    with Ledger(folder, manifest("none", "mine", sweeps=("world.push",), swept=swept)) as ledger:
        for values in swept:
            for seed in range(7):
                fell = 2.5 if seed < 3 else None
                ledger.append(row("none", seed, swept=values, fell=fell))
                ledger.append(row("mine", seed, swept=values))
    return folder


@pytest.mark.parametrize("ending", BEGINS)
def test_one_option_draws_it_in_the_form_that_the_ending_says(
    folder: Path, tmp_path: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path, again = tmp_path / "new" / f"figure{ending}", tmp_path / f"again{ending}"
    assert main(["campaign", "--report", str(folder), "--figure", str(path)]) == 0
    assert capsys.readouterr().out.endswith(f"{path}\n")
    write_figure(read_report(folder, None, 0), again)
    first, second = path.read_bytes(), again.read_bytes()
    assert first.startswith(BEGINS[ending])
    assert first == second


def test_success_falls_and_errors_stand_below_each_other(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "all.png"
    write_figure(read_report(folder, None, 0), path)
    with Image.open(path) as image:
        width, height = image.size
        assert width == 1100
        assert height > 700
        ink = image.convert("L").point(lambda value: 255 * (value < 128))
        for third in range(3):  # of it something is drawn everywhere
            part = ink.crop((0, third * height // 3, width, (third + 1) * height // 3))
            assert part.getbbox() is not None


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("figure.jpg", "expected a file that ends in .png, .pdf or .svg"),
        ("figure", "expected a file that ends in .png, .pdf or .svg"),
        ("file/figure.png", "expected a file in a folder that can be made"),
    ],
)
def test_a_file_that_cannot_be_drawn_is_refused_before_anything_is_walked(
    tmp_path: Path, name: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    words = ["campaign", "flat", "--planners", "none", "--out", str(tmp_path / "c")]
    assert main([*words, "--figure", str(tmp_path / name)]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("quadriga: --figure")
    assert complaint.count("\n") == 1
    assert message in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
