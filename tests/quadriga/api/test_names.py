"""What `import quadriga` has: the same names for scripts and for type checkers, none too early."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import quadriga

STUB = Path(quadriga.__file__).with_suffix(".pyi")


def test_every_name_leads_to_what_the_types_say() -> None:
    stub = ast.parse(STUB.read_text(encoding="utf-8"))
    typed = {
        alias.name: node.module
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    for name in quadriga.__all__:
        found = getattr(quadriga, name)
        assert found.__module__ == typed.pop(name), name
        assert found.__doc__, name
    assert not typed
    assert {*quadriga.__all__} <= {*dir(quadriga)}


def test_nothing_is_imported_before_it_is_asked_for() -> None:
    code = "import sys; before = {*sys.modules}; import quadriga; print(*{*sys.modules} - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {*done.stdout.split()} <= {"quadriga", "__future__"}


def test_a_name_that_there_is_not_is_the_usual_error() -> None:
    with pytest.raises(AttributeError, match="module 'quadriga' has no attribute 'wlak'"):
        quadriga.wlak  # type: ignore[attr-defined]  # noqa: B018
