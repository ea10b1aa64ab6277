"""Wheel and source distribution of this project: `make dist`.

The wheel is built from the source distribution, so that what is not in that is missed at once.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

TOP: Final = Path(__file__).parents[2]
_LEFT_OUT: Final = (".*", "runs", "build", "dist", "*.egg-info", "__pycache__", "_build", "tests")


def build_dist(out: Path) -> tuple[Path, Path]:
    """The wheel and the source distribution that it is built from, in the folder `out`."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"  # a build leaves files there
        shutil.copytree(TOP, source, symlinks=True, ignore=shutil.ignore_patterns(*_LEFT_OUT))
        uv = ("uv", "build", "--quiet", "--no-build-isolation", "--python", sys.executable)
        subprocess.run([sys.executable, "-m", *uv, "--out-dir", out, source], check=True)
    return next(out.glob("*.whl")), next(out.glob("*.tar.gz"))


if __name__ == "__main__":
    for path in build_dist(TOP / "dist"):
        print(f"{path}, {path.stat().st_size / 1e6:.1f} MB")
