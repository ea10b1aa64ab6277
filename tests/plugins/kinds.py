"""Packages that add to quadriga: those of this folder, and such as a test puts together."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.shared.planner_kinds import GROUP
from quadriga.shared.runtime.places import SOURCE

ONE = """
from quadriga.shared.planner_kinds import PlannerKind

KIND = PlannerKind({arguments})
"""


def install_package(name: str, folder: Path) -> str:
    """Install a package of `tests/plugins` with pip; the PYTHONPATH of processes that find it."""
    source, target = folder / "source", str(folder / "installed")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(SOURCE / "tests" / "plugins" / name, source, ignore=ignored)
    flags = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--target", target)
    subprocess.run([sys.executable, "-m", "pip", "install", *flags, str(source)], check=True)
    return os.pathsep.join(filter(None, (target, os.environ.get("PYTHONPATH"))))


def install_module(
    folder: Path, monkeypatch: pytest.MonkeyPatch, kind: str, text: str, owner: str = ""
) -> None:
    """Install a module whose KIND is what the entry point `kind` leads to, as pip would.

    Args:
        folder: on the path from here on.
        monkeypatch: puts it there.
        kind: name of the entry point.
        text: source of the module.
        owner: name of the distribution, by default `quadriga-<kind>`.
    """
    owner = owner or f"quadriga-{kind}"
    module = f"{owner.replace('-', '_')}_module"
    (folder / f"{module}.py").write_text(text, encoding="utf-8")
    info = folder / f"{owner.replace('-', '_')}-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {owner}\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{kind} = {module}:KIND\n")
    monkeypatch.syspath_prepend(folder)


def install_kind(folder: Path, monkeypatch: pytest.MonkeyPatch, kind: str, arguments: str) -> None:
    """Install a package with one kind of planner, whose facts are `arguments`, as source."""
    install_module(
        folder, monkeypatch, kind, ONE.format(arguments=f"{kind!r}, 'title', {arguments}")
    )
