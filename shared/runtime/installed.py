"""What is installed here: this project's version and files, and the libraries it computes by."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import platform
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Final

import quadriga

PROJECT: Final = "quadriga"
# Begins the command of every process started here. -P: a file `random.py` in the working directory
# must not be imported in the place of Python's.
PYTHON: Final = (sys.executable, "-P")
# What a run's figures depend on.
LIBRARIES: Final = ("eclipse-zenoh", "mujoco", "pin", "numpy", "daqp", "osqp", "numba", "msgpack")


def project_version() -> str:
    """This project's version; "" in a source folder that is not installed."""
    return _version(PROJECT)


def package_versions() -> dict[str, str]:
    """Versions by name: Python, the machine's kind, this project, libraries that are installed."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    versions = {name: _version(name) for name in (PROJECT, *LIBRARIES)}
    return found | {name: version for name, version in versions.items() if version}


@cache
def code_digest() -> str:
    """Digest of this project's source files, wherever they lie; 16 hexadecimal digits."""
    folder = Path(quadriga.__file__).parent
    found = (  # in a checkout some of its folders are links, which `rglob` does not follow
        Path(parent, name)
        for parent, _, names in os.walk(folder, followlinks=True)
        for name in names
        if name.endswith(".py")
    )
    return digest_files(sorted((path.relative_to(folder).as_posix(), path) for path in found))


def digest_files(files: Iterable[tuple[object, Path]]) -> str:
    """Digest of files and of the names that they go by here; 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for name, path in files:
        digest.update(f"\0{name}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def _version(package: str) -> str:
    with suppress(importlib.metadata.PackageNotFoundError):
        return importlib.metadata.version(package)
    return ""
