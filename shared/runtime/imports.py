"""Which source files some modules depend on, found by following their imports."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from textwrap import dedent
from typing import Final

from quadriga.shared.errors import QuadrigaError

_FIRST_LINE: Final = re.compile(r"\s*(import\s+\w|from\s+[\w.]+\s+(import\b|\\$))")
_CHOICE: Final = re.compile(r"""\bimport_module\(f["']([\w.]+)\.\{""")


def followed_files(root: Path, modules: Iterable[str]) -> Sequence[Path]:
    """Files of modules and of all that they import below `root`, sorted.

    Imports anywhere in a file count, also those within functions, and the packages that modules
    lie in. Other packages are left out, also where they lie beside these: installed, that is all
    libraries. Of `import_module(f"package.{name}")` every
    module of the package counts; whatever else `import_module` is given does not.

    Args:
        root: the folder that the packages lie in.
        modules: dotted names, for instance `quadriga.agents.agent`.

    Raises:
        QuadrigaError: there is no module, or no file of one.
    """
    todo: list[tuple[str, Path]] = []
    for name in modules:
        file = _file(root, name)
        if file is None:
            raise QuadrigaError(
                f"module {name}", "no such file", f"one below {root}", "was the module renamed?"
            )
        todo.append((name, file))
    if not todo:
        raise QuadrigaError("modules whose imports to follow", "none", "at least one")
    files, own = {file for _, file in todo}, {name.partition(".")[0] for name, _ in todo}
    while todo:
        name, file = todo.pop()
        package = name if file.name == "__init__.py" else name.rpartition(".")[0]
        text = file.read_text(encoding="utf-8")
        for imported in {*_parents(name), *_imports(package, text), *_chosen(root, text)}:
            path = _file(root, imported) if imported.partition(".")[0] in own else None
            if path is not None and path not in files:
                files.add(path)
                todo.append((imported, path))
    return sorted(files)


def _file(root: Path, name: str) -> Path | None:
    place = root.joinpath(*name.split("."))
    for file in (place.with_name(f"{place.name}.py"), place / "__init__.py"):
        if file.is_file():
            return file
    return None


def _parents(name: str) -> Iterator[str]:
    """The packages that a module lies in, and itself."""
    parts = name.split(".")
    yield from (".".join(parts[:count]) for count in range(1, len(parts) + 1))


def _imports(package: str, text: str) -> Iterator[str]:
    """Names of all that may be a module: `from a import b` may mean `a.b`."""
    for statement in _statements(text):
        if isinstance(statement, ast.Import):
            names = [alias.name for alias in statement.names]
        else:
            parts = package.split(".")
            above = parts[: len(parts) + 1 - statement.level] if statement.level else []
            base = [*above, *filter(None, [statement.module])]
            names = [".".join([*base, alias.name]) for alias in statement.names]
        for name in names:
            yield from _parents(name)


def _chosen(root: Path, text: str) -> Iterator[str]:
    """Names of the modules that a file chooses one of when it runs."""
    for package in _CHOICE.findall(text):
        folder = root.joinpath(*package.split("."))
        yield from (f"{package}.{file.stem}" for file in sorted(folder.glob("[!_]*.py")))


def _statements(text: str) -> Iterator[ast.Import | ast.ImportFrom]:
    """The import statements of a file.

    Each is parsed by itself: to parse whole files would cost every process that compiles 0.1 s
    more at its start.
    """
    lines = text.splitlines()
    for first, line in enumerate(lines):
        if not _FIRST_LINE.match(line):
            continue
        for end in range(first + 1, len(lines) + 1):
            statement = dedent("\n".join(lines[first:end]))
            try:
                parsed = ast.parse(statement).body
            except SyntaxError:
                if "(" in statement or statement.endswith("\\"):
                    continue  # it may go on in the next line
                break  # prose that begins as an import does
            yield from (one for one in parsed if isinstance(one, ast.Import | ast.ImportFrom))
            break
