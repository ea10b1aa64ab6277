"""The house keeps its shape: sizes, names, links, and no two files that import each other."""

from __future__ import annotations

import ast
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Final

import pytest

TOP: Final = Path(__file__).parents[1]
WALLS: Final = ("agents", "plant", "shared", "sim_server")
ROOTS: Final = (*WALLS, "quadriga", "benchmarks")
# Lines of each package, of Python and of pages, docstrings and blanks included. Lowering one is
# always right; raising one needs a reason beside it.
BUDGETS: Final[Mapping[str, int]] = {
    "agents": 9_550,  # planned: 8,000; left: cooperation, periodic fits; came: plain ticks
    "plant": 1_142,  # planned: 1,000
    "sim_server": 2_656,  # planned: 2,600
    "bridges": 1_904,
    "shared": 8_832,  # planned: 7,200; left: Unitree's protocols, the barrier; came: the plant link
    "quadriga": 39_063,  # planned: 18,200; left: harnesses of experiments, report, commands
    "benchmarks": 2_079,  # planned: 1,800; left: plans as the paper writes them, endurance
    "tests": 45_444,  # planned: 28,000; came: what a stranger packs, the release
}
COUNTED: Final = (".py", ".js", ".css", ".html")
MOST_ARGUMENTS: Final = 8
MOST_SKIPS: Final = 99  # matrices and tables that the formatter would tear apart

Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def trees() -> Mapping[Path, ast.Module]:
    """Every source file but the tests, by its path from the top; links are not followed."""
    found = (path for root in ROOTS for path in sorted((TOP / root).rglob("*.py")))
    return {
        path.relative_to(TOP): ast.parse(path.read_text(encoding="utf-8"))
        for path in found
        if not any(parent.is_symlink() for parent in path.parents)
    }


def functions() -> Iterator[tuple[str, Function]]:
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, Function):
                yield f"{path}:{node.name}", node


def module_of(path: Path) -> str:
    parts = list(path.with_suffix("").parts)
    if parts[0] in WALLS:
        parts.insert(0, "quadriga")
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(tree: ast.Module, modules: set[str]) -> Iterator[str]:
    """Modules of this project that a file imports, wherever in the file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inside = f"{node.module}.{alias.name}"
                if inside in modules:
                    yield inside
                elif node.module in modules:
                    yield node.module


@pytest.mark.parametrize("wall", WALLS)
def test_walls_stand_at_the_top_and_are_linked_into_the_package(wall: str) -> None:
    link = TOP / "quadriga" / wall
    assert (TOP / wall / "__init__.py").is_file()
    assert link.is_symlink()
    assert link.resolve() == (TOP / wall).resolve()


@pytest.mark.parametrize("package", BUDGETS)
def test_a_package_keeps_its_budget(package: str) -> None:
    lines = 0
    for path in sorted((TOP / package).rglob("*")):
        if path.suffix in COUNTED and not any(p.is_symlink() for p in (path, *path.parents)):
            lines += len(path.read_text(encoding="utf-8").splitlines())
    assert lines <= BUDGETS[package]


def test_functions_take_few_arguments() -> None:
    for name, node in functions():
        given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        if given and given[0].arg in ("self", "cls"):
            given = given[1:]
        assert len(given) <= MOST_ARGUMENTS, name


def test_each_class_has_a_name_of_its_own() -> None:
    names = Counter(
        node.name
        for tree in trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    )
    assert not [name for name, count in names.items() if count > 1]


def test_files_import_each_other_in_one_direction() -> None:
    modules = {module_of(path) for path in trees()}
    graph: defaultdict[str, set[str]] = defaultdict(set)
    for path, tree in trees().items():
        name = module_of(path)
        graph[name] |= set(imports_of(tree, modules)) - {name}
    try:
        assert list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"files that import each other: {' -> '.join(error.args[1])}")


def test_every_process_is_started_by_the_words_that_keep_the_working_directory_out() -> None:
    found = {path.name for path in trees() if "sys.executable" in (TOP / path).read_text()}
    found -= {path.name for path in (TOP / "benchmarks").rglob("*.py")}  # which lie there
    assert found == {"installed.py", "controller_program.py"}, "the second starts the user's own"


def test_the_formatter_is_seldom_told_to_look_away() -> None:
    files = [*(TOP / path for path in trees()), *(TOP / "tests").rglob("*.py")]
    skips = sum(path.read_text(encoding="utf-8").count("# fmt: " + "skip") for path in files)
    assert skips <= MOST_SKIPS
