"""`make check` runs the tests that a change asks for."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changed import TOP, find_tests


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ("agents/gait.py", ["tests/agents/test_gait.py"]),
        ("tests/agents/test_gait.py", ["tests/agents/test_gait.py"]),
        ("README.md", []),
        ("setup.py", []),
        ("agents/no_such_folder/module.py", []),
    ],
)
def test_a_module_has_its_test_file(changed: str, expected: list[str]) -> None:
    assert find_tests(Path(changed)) == [Path(test) for test in expected]


def test_a_module_without_one_has_those_of_its_package() -> None:
    module = Path("shared/link/plant_end.py")
    assert (TOP / module).is_file()
    assert not (TOP / "tests/shared/link/test_plant_end.py").exists()
    found = find_tests(module)
    assert Path("tests/shared/link/test_ticks.py") in found
    assert all((TOP / test).is_file() for test in found)
