"""Where machine code is kept between processes, by all that it is made of. No compiler is imported.

numba looks at a function's own file alone: after a change of a function that it calls, or of a
constant from another file, it would go on with the old code.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Final

from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.imports import followed_files
from quadriga.shared.runtime.places import SOURCE, cache_dir

_PACKAGES: Final = ("agents", "bridges", "plant", "shared", "sim_server")
_MARK: Final = "\n@compiled"
_KNOWN: Final = "sources.json"  # the digest of files that looked like those of today
_TAG: Final = "CACHEDIR.TAG"  # see bford.info/cachedir: backups leave such folders out
_OURS: Final = "Signature: 8a477f597d28d172789f06886806bc55\n# Machine code of quadriga.\n"
REHEARSED: Final = "rehearsed"  # a file beside the machine code of all that an agent runs
_BYTES: Final = 100_000_000  # that all machine code takes, at most


def sources(root: Path) -> Sequence[Path]:
    """Files that machine code is made of: those with compiled functions, and all they import.

    Args:
        root: the folder of this project's package `quadriga`.

    Raises:
        QuadrigaError: no file has compiled functions.
    """
    marked = (path for path in _files(root) if _MARK in path.read_text(encoding="utf-8"))
    return followed_files(
        root, (".".join(path.relative_to(root).with_suffix("").parts) for path in marked)
    )


def is_switched_off() -> bool:
    """Whether the user wants no machine code (NUMBA_DISABLE_JIT)."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


@lru_cache(maxsize=1)
def compiled_folder() -> Path | None:
    """The folder of this code's machine code, made if need be; None: nothing can be kept.

    What older code has left is removed then: folders that carry our mark, and no others.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    bases = (
        [Path(given)] if given else [SOURCE / "quadriga" / "shared" / "__pycache__", cache_dir()]
    )
    digest = _digest(bases)
    for base in bases:  # the user's own where the code cannot be written to
        folder = base / f"compiled-{digest}"
        with suppress(OSError):
            if not folder.exists():
                for tag in [*base.glob(f"compiled-*/{_TAG}")]:
                    _remove_if_ours(tag)
                folder.mkdir(parents=True, exist_ok=True)
            if not (folder / _TAG).exists():
                write_text(folder / _TAG, _OURS)
            room = (folder / REHEARSED).exists() or shutil.disk_usage(folder).free > _BYTES
            if room and os.access(folder, os.W_OK):
                return folder
    return None


def _remove_if_ours(tag: Path) -> None:
    """Remove the folder that a tag lies in, if it is one of machine code of this project."""
    with suppress(OSError, UnicodeDecodeError):
        if tag.read_text(encoding="ascii") == _OURS:
            shutil.rmtree(tag.parent, ignore_errors=True)


def _digest(bases: Sequence[Path]) -> str:
    """Digest of all that machine code is made of, compiler included.

    To follow all imports costs every process 0.1 s at its start. So it is kept in one of the
    folders, with the sizes and times of the files, by which Python too knows an old file.
    """
    compiler = f"{version('numba')} {sys.version}"
    stats = ((path, path.stat()) for path in _files(SOURCE))
    look = "".join(f"{path} {stat.st_size} {stat.st_mtime_ns}\n" for path, stat in stats)
    seen = hashlib.sha256(f"{compiler}\n{look}".encode()).hexdigest()
    for base in bases:
        with suppress(OSError, ValueError, TypeError, KeyError):
            known = json.loads((base / _KNOWN).read_text(encoding="utf-8"))
            if known["seen"] == seen:
                return str(known["digest"])
    made_of = hashlib.sha256(compiler.encode())
    for path in sources(SOURCE):
        made_of.update(path.read_bytes())
    digest = made_of.hexdigest()[:16]
    for base in bases:
        with suppress(OSError):
            base.mkdir(parents=True, exist_ok=True)
            write_text(base / _KNOWN, json.dumps({"seen": seen, "digest": digest}))
            break
    return digest


def _files(root: Path) -> Iterator[Path]:
    """All Python files that compiled functions may be in or import, in a fixed order."""
    for name in _PACKAGES:
        yield from sorted((root / "quadriga" / name).rglob("*.py"))
