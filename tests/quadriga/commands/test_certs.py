"""`quadriga certs` as it is typed."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.commands.parser import main

Run = pytest.CaptureFixture[str]


def certs(capsys: Run, folder: Path, *words: str) -> tuple[int, str, str]:
    options = ("--set", f"bus.certificates={folder}", "--robots", "2")
    status = main(["certs", *words, *options])
    out, err = capsys.readouterr()
    return status, out, err


def state_of(out: str, identity: str) -> list[str]:
    (row,) = [line.split() for line in out.splitlines() if line.startswith(f"{identity} ")]
    return row[1:]


def test_made_renewed_and_shown(capsys: Run, tmp_path: Path) -> None:
    folder = tmp_path / "certs"
    status, out, err = certs(capsys, folder, "make", "--router", "10.0.0.1", "--days", "20")
    assert (status, state_of(out, "r1")) == (0, ["20", "valid"])
    assert f"got a certificate in {folder}" in err
    _, out, err = certs(capsys, folder, "renew", "r1")
    assert "new: r1; copy their folders" in err
    assert state_of(out, "r1") == ["30", "valid"]
    assert certs(capsys, folder, "show") == (0, out, "")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["make", "r1"], "NAME: got r1, expected none with 'make'"),
        (["renew", "r3"], "certificate of: got 'r3'"),
        (["make", "--days", "0"], "--days: got 0, expected above 0"),
        (["renew"], "the authority of a team"),
        (["show"], "certs: got no certificate, expected the certificates of a team"),
    ],
)
def test_a_mistake_costs_one_line(
    capsys: Run, tmp_path: Path, words: list[str], message: str
) -> None:
    status, out, err = certs(capsys, tmp_path / "certs", *words)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
