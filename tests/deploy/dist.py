"""Wheel and source distribution of this project: `make dist`.

The wheel is built from the source distribution, so that what is not in that is missed at once.
`--walk` installs it, with all it needs from the package index, into an environment of its own, and
walks a team there.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import Final

TOP: Final = Path(__file__).parents[2]
_LEFT_OUT: Final = (".*", "runs", "build", "dist", "*.egg-info", "__pycache__", "_build", "tests")
_BUILD: Final = "import sys; from setuptools import build_meta; build_meta.{}(sys.argv[1])"
_WALK: Final = ("--robots", "2", "--planner", "none", "--seconds", "2", "--no-render")
_SCRIPT: Final = """
import quadriga
run = quadriga.open("run")
print(run.summary["fallen"], run["r1/state"].shape, run.replay("r2").equal)
"""


def build_dist(out: Path) -> tuple[Path, Path]:
    """The wheel and the source distribution that it is built from, in the folder `out`."""
    with tempfile.TemporaryDirectory() as folder:
        source = copy_source(Path(folder) / "source")
        sdist = _build(source, "build_sdist", out)
        unpacked = Path(folder) / "unpacked"
        with tarfile.open(sdist) as archive:
            archive.extractall(unpacked, filter="data")
        wheel = build_wheel(next(unpacked.iterdir()), out)
    return wheel, sdist


def build_wheel(source: Path, out: Path) -> Path:
    """The wheel of a source folder, in the folder `out`."""
    return _build(source, "build_wheel", out)


def copy_source(to: Path) -> Path:
    """What is in the checkout and is no test, in a new folder: a build leaves files there."""
    shutil.copytree(TOP, to, symlinks=True, ignore=shutil.ignore_patterns(*_LEFT_OUT))
    return to


def _build(source: Path, what: str, out: Path) -> Path:
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", _BUILD.format(what), folder],
            cwd=source,
            check=False,
            capture_output=True,
            text=True,
        )
        if done.returncode:
            raise SystemExit(done.stdout + done.stderr)
        (made,) = Path(folder).iterdir()
        return Path(shutil.copy(made, out))


def walk_elsewhere(wheel: Path) -> None:
    """Install the wheel into a new environment, in a temporary folder, and walk a team there."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bin_ = folder / "environment" / "bin"
        _run(folder, sys.executable, "-m", "venv", str(folder / "environment"))
        options = ("--quiet", "--disable-pip-version-check", "-c", str(TOP / "requirements.lock"))
        _run(folder, str(bin_ / "python"), "-m", "pip", "install", *options, str(wheel))
        _run(folder, str(bin_ / "quadriga"), "scenarios")
        _run(folder, str(bin_ / "quadriga"), "experiments", "--list")
        _run(folder, str(bin_ / "quadriga"), "walk", "--out", "run", *_WALK)
        _run(folder, str(bin_ / "python"), "-c", _SCRIPT)


def _run(folder: Path, *words: str) -> None:
    """Run a command in a folder, with nothing of this checkout on its path."""
    print("$", " ".join(words), flush=True)
    alien = {"PYTHONPATH", "VIRTUAL_ENV", "XDG_CACHE_HOME"}
    mine = {name: value for name, value in os.environ.items() if name not in alien}
    subprocess.run(words, cwd=folder, env={**mine, "XDG_CACHE_HOME": str(folder)}, check=True)


def main() -> None:
    """Build both into dist/, and walk if asked to."""
    options = argparse.ArgumentParser(prog="make dist", description=__doc__)
    options.add_argument("--walk", action="store_true", help="install the wheel elsewhere and walk")
    options.add_argument("--out", type=Path, default=TOP / "dist", help="folder (dist)")
    arguments = options.parse_args()
    wheel, sdist = build_dist(arguments.out)
    for path in (sdist, wheel):
        print(f"{path}, {path.stat().st_size / 1e6:.1f} MB", flush=True)
    if arguments.walk:
        walk_elsewhere(wheel.resolve())


if __name__ == "__main__":
    main()
