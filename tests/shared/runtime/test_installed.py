"""A digest of the sources changes with them."""

from __future__ import annotations

from pathlib import Path

import pytest

import quadriga
from quadriga.shared.runtime import installed


def test_the_digest_is_that_of_names_and_contents(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "package").mkdir()
    (tmp_path / "wall").mkdir()
    (tmp_path / "package" / "wall").symlink_to(tmp_path / "wall")
    (tmp_path / "wall" / "a.py").write_text("x = 1\n")
    (tmp_path / "package" / "__init__.py").write_text("")
    monkeypatch.setattr(quadriga, "__file__", str(tmp_path / "package" / "__init__.py"))

    def digest() -> str:
        return installed.code_digest.__wrapped__()

    first = digest()
    (tmp_path / "wall" / "notes.txt").write_text("no code")
    assert digest() == first
    (tmp_path / "wall" / "a.py").write_text("x = 2\n")
    second = digest()
    (tmp_path / "wall" / "a.py").rename(tmp_path / "wall" / "b.py")
    assert len({first, second, digest()}) == 3
