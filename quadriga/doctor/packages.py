"""Whether Python packages have the versions that this project asks for: pure."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final

from quadriga.shared.bus.diagnostics import BAD, GOOD, UNKNOWN, Diagnosis

PACKAGES: Final = "packages"
_REQUIREMENT: Final = re.compile(r"([A-Za-z0-9._-]+)\s*(?:\[[^\]]*\])?\s*\(?([^)]*)\)?")
_BOUND: Final = re.compile(r"(>=|<|==)(\d+(?:\.\d+)*)")
_RELEASE: Final = re.compile(r"\d+(?:\.\d+)*")


def check_packages(
    requirements: tuple[str, ...] | None,
    installed: Mapping[str, str],
    shadowing: Sequence[str] = (),
) -> Diagnosis:
    """Versions that are installed against those that are asked for.

    Args:
        requirements: such as `name>=1.0,<2`; None: not known.
        installed: versions by name; what is not installed is not in it.
        shadowing: files that are imported in the place of what is installed.
    """
    if shadowing:
        text = f"imported in the place of what is installed: {', '.join(shadowing)}"
        return Diagnosis(PACKAGES, BAD, text, "rename it, or take its folder out of PYTHONPATH")
    if requirements is None:
        text = "what this project asks for is not known: it is not installed"
        return Diagnosis(PACKAGES, UNKNOWN, text)
    wrong, unread = list[str](), list[str]()
    for line in requirements:
        name, bounds = split_requirement(line)
        version = installed.get(name)
        if version is None:
            wrong.append(f"{name} is not installed")
            continue
        fits = [_satisfies(version, bound) for bound in bounds]
        if None in fits:
            unread.append(line)
        elif not all(fits):
            wrong.append(f"{name} is {version}, not {','.join(bounds)}")
    if wrong:
        remedy = "pip install -c requirements.lock -e . in the project's folder"
        return Diagnosis(PACKAGES, BAD, "; ".join(wrong), remedy)
    if unread:
        return Diagnosis(PACKAGES, UNKNOWN, f"{'; '.join(unread)}: not understood here")
    return Diagnosis(PACKAGES, GOOD, f"{len(requirements)} packages are as asked for")


def split_requirement(line: str) -> tuple[str, tuple[str, ...]]:
    """The package that a requirement is of, and the bounds of its version."""
    found = _REQUIREMENT.match(line)
    if found is None:
        return line, ()
    return found[1], tuple(filter(None, found[2].replace(" ", "").split(",")))


def _satisfies(version: str, bound: str) -> bool | None:
    """Whether a version is within a bound; None of a form that this project does not use."""
    found, release = _BOUND.fullmatch(bound), _RELEASE.match(version)
    if found is None or release is None:
        return None
    have, want = _numbers(release[0]), _numbers(found[2])
    length = max(len(have), len(want))
    have, want = (numbers + (0,) * (length - len(numbers)) for numbers in (have, want))
    return {">=": have >= want, "<": have < want, "==": have == want}[found[1]]


def _numbers(release: str) -> tuple[int, ...]:
    return tuple(map(int, release.split(".")))
