"""Where machine code is kept between processes, by all that it is made of. No compiler is imported.

numba looks at a function's own file alone: after a change of a function that it calls, or of a
constant from another file, it would go on with the old code.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Final

from quadriga.shared.runtime.places import SOURCE, cache_dir

_PACKAGES: Final = ("agents", "bridges", "plant", "shared", "sim_server")
_MARK: Final = "\n@compiled"
_IMPORT: Final = re.compile(r"^[ \t]*(?:from|import) (\w[\w.]*)(?: import (\([^)]*\)|.*))?", re.M)
_CHOICE: Final = re.compile(r"""\bimport_module\(f["']([\w.]+)\.\{""")
REHEARSED: Final = "rehearsed"  # a file beside the machine code of all that an agent runs
_BYTES: Final = 100_000_000  # that all machine code takes, at most
_DIGITS: Final = 16  # hexadecimal, of a digest


def followed_files(root: Path, modules: Iterable[str]) -> list[Path]:
    """Files of modules and of all of this project that they import, sorted.

    Imports anywhere in a file count, also those within functions, and the packages that modules
    lie in. Of `import_module(f"package.{name}")` every module of the package counts.

    Args:
        root: the folder that the packages lie in.
        modules: dotted names, for instance `quadriga.agents.agent`; one without a file is left out.
    """
    todo = [*modules]
    own = {name.partition(".")[0] for name in todo}
    found: dict[str, Path | None] = {}
    while todo:
        name = todo.pop()
        if name in found or name.partition(".")[0] not in own:
            continue
        place = root.joinpath(*name.split("."))
        files = (place.with_suffix(".py"), place / "__init__.py")
        file = found[name] = next((file for file in files if file.is_file()), None)
        if file is None:
            continue
        todo.append(name.rpartition(".")[0] or name)
        text = file.read_text(encoding="utf-8")
        for module, names in _IMPORT.findall(text):
            todo += [module, *(f"{module}.{part}" for part in re.findall(r"\w+", names))]
        for package in _CHOICE.findall(text):
            folder = root.joinpath(*package.split("."))
            todo += [f"{package}.{file.stem}" for file in folder.glob("[!_]*.py")]
    return sorted(filter(None, found.values()))


def sources(root: Path) -> list[Path]:
    """Files that machine code is made of: those with compiled functions, and all they import.

    Args:
        root: the folder of this project's package `quadriga`.
    """
    files = (file for name in _PACKAGES for file in (root / "quadriga" / name).rglob("*.py"))
    marked = (file for file in files if _MARK in file.read_text(encoding="utf-8"))
    return followed_files(
        root, [".".join(file.relative_to(root).with_suffix("").parts) for file in marked]
    )


def is_switched_off() -> bool:
    """Whether the user wants no machine code (NUMBA_DISABLE_JIT)."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


@lru_cache(maxsize=1)
def compiled_folder() -> Path | None:
    """The folder of this code's machine code, made if need be; None: nothing can be kept.

    What older code has left beside it is removed then.
    """
    digest = hashlib.sha256(f"{version('numba')} {sys.version}".encode())
    for path in sources(SOURCE):
        digest.update(path.read_bytes())
    given = os.environ.get("NUMBA_CACHE_DIR")
    own = SOURCE / "quadriga" / "shared" / "__pycache__"
    for base in [Path(given)] if given else [own, cache_dir()]:
        folder = base / f"compiled-{digest.hexdigest()[:_DIGITS]}"
        with suppress(OSError):
            if not folder.exists():
                for old in base.glob(f"compiled-{'[0-9a-f]' * _DIGITS}"):
                    shutil.rmtree(old, ignore_errors=True)
                folder.mkdir(parents=True, exist_ok=True)
            room = (folder / REHEARSED).exists() or shutil.disk_usage(folder).free > _BYTES
            if room and os.access(folder, os.W_OK):
                return folder
    return None
