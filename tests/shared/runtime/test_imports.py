"""Files that modules depend on are found whatever form their imports have."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime.imports import followed_files


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name in ("pack/__init__", "pack/room/__init__", "pack/a", "pack/b", "pack/room/c"):
        put(tmp_path, name, "X = 1\n")
    return tmp_path


def put(root: Path, name: str, text: str) -> None:
    path = root / f"{name}.py"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def names(root: Path, *modules: str) -> set[str]:
    return {
        str(path.relative_to(root).with_suffix("")) for path in followed_files(root, modules)
    } - {"pack/__init__"}


@pytest.mark.parametrize(
    "text",
    [
        "import pack.room.c\n",
        "import os, pack.room.c as other\n",
        "from pack.room import c\n",
        "from pack.room.c import X\n",
        "from pack.room.c import (  # why (and why not)\n    X,\n    X as Y,\n)\n",
        "from pack.room \\\n    import c\n",
        "from . import b\nfrom .room.c import X\n",
        "def f():\n    if True:\n        from pack.room.c import X\n    return X\n",
        "try:\n    import pack.room.c\nexcept ImportError:\n    pass\n",
    ],
)
def test_every_form_of_an_import_is_followed(root: Path, text: str) -> None:
    put(root, "pack/a", text)
    assert names(root, "pack.a") - {"pack/b"} == {"pack/a", "pack/room/__init__", "pack/room/c"}


def test_every_module_that_may_be_chosen_is_followed(root: Path) -> None:
    put(root, "pack/a", 'def f(name):\n    return import_module(f"pack.room.{name}")\n')
    assert names(root, "pack.a") == {"pack/a", "pack/room/__init__", "pack/room/c"}


def test_libraries_beside_the_package_are_left_out(root: Path) -> None:
    """As in the folder that packages are installed in."""
    put(root, "library/__init__", "import library.part\n")
    put(root, "library/part", "X = 1\n")
    put(root, "pack/a", "import library\nfrom pack import b\n")
    assert names(root, "pack.a") == {"pack/a", "pack/b"}


def test_imports_of_imports_count_and_circles_end(root: Path) -> None:
    put(root, "pack/a", "from pack import b\n")
    put(root, "pack/b", "from pack import a\nfrom pack.room.c import X\n")
    assert names(root, "pack.a") == {"pack/a", "pack/b", "pack/room/__init__", "pack/room/c"}


def test_what_a_package_imports_counts_for_its_modules(root: Path) -> None:
    put(root, "pack/room/__init__", "from ..b import X\n")
    assert names(root, "pack.room.c") == {"pack/b", "pack/room/__init__", "pack/room/c"}


def test_prose_other_packages_and_what_is_not_there_are_passed_over(root: Path) -> None:
    put(
        root,
        "pack/a",
        '"""Prose.\n\nfrom here on imports\nimport is a word.\n"""\nimport os.path\n',
    )
    assert names(root, "pack.a") == {"pack/a"}


def test_a_missing_module_and_none_at_all_are_errors(root: Path) -> None:
    with pytest.raises(QuadrigaError, match=r"module pack\.gone: got no such file"):
        followed_files(root, ["pack.a", "pack.gone"])
    with pytest.raises(QuadrigaError, match="got none, expected at least one"):
        followed_files(root, [])
