"""The image: what goes into it is named by version and hash, and nobody in it is root."""

from __future__ import annotations

import importlib.metadata
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

TOP = Path(__file__).parents[2]
DOCKERFILE = (TOP / "deploy/Dockerfile").read_text(encoding="utf-8")
LAST_STAGE = DOCKERFILE[DOCKERFILE.rindex("FROM ") :].replace("\\\n", " ")
LOCK = (TOP / "deploy/image.lock").read_text(encoding="utf-8")
PROJECT: dict[str, Any] = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))
COMPOSE: dict[str, Any] = yaml.safe_load((TOP / "docker-compose.yml").read_text(encoding="utf-8"))


def locked_by_hash() -> dict[str, tuple[str, list[str]]]:
    """Version and hashes by package, of a file that has nothing else in it."""
    plain = "\n".join(line for line in LOCK.splitlines() if not line.startswith("#"))
    found = {}
    for entry in re.split(r"\n(?=\S)", plain.strip()):
        first, *rest = [line.strip(" \\") for line in entry.splitlines()]
        name, version = re.fullmatch(r"([a-z0-9-]+)==([0-9][\w.]*)", first).groups()  # type: ignore[union-attr]
        found[name] = version, rest
    return found


def needed(requirements: list[str]) -> Iterator[str]:
    """All packages that these need here, as they are installed."""
    for text in requirements:
        requirement = Requirement(text)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        name = canonicalize_name(requirement.name)
        yield name
        yield from needed(importlib.metadata.requires(name) or [])


def test_the_image_gets_the_versions_that_are_tested_each_with_its_hashes() -> None:
    lines = (TOP / "requirements.lock").read_text(encoding="utf-8").splitlines()
    tested = dict(line.split("==") for line in lines if "==" in line)
    found = locked_by_hash()
    assert {name: version for name, (version, _) in found.items()}.items() <= tested.items()
    for name, (_, hashes) in found.items():
        assert hashes, name
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", item) for item in hashes), name


def test_the_image_gets_all_that_a_walk_needs_and_nothing_else() -> None:
    """If not: `make image-lock`."""
    requirements = PROJECT["project"]["dependencies"] + PROJECT["build-system"]["requires"]
    assert locked_by_hash().keys() == set(needed(requirements))


def test_pip_takes_nothing_without_a_hash_and_builds_nothing() -> None:
    installs = re.findall(r"pip install (.*)$", DOCKERFILE, re.M)
    assert installs == [
        "--require-hashes --only-binary :all: -r image.lock",
        "--no-index --no-deps --no-build-isolation .",
    ]


def test_nobody_is_root_in_the_image() -> None:
    user = re.findall(r"^USER (\d+):(\d+)$", LAST_STAGE, re.M)[-1]
    assert all(int(number) >= 1000 for number in user)
    assert f"chown -R {':'.join(user)} /cache /health /secrets /work" in LAST_STAGE


def test_each_volume_has_a_folder_whose_owner_it_takes_over() -> None:
    (names,) = re.findall(r"for name in ([a-z0-9 ]+);", LAST_STAGE)
    secrets = {name.removeprefix("secret-") for name in COMPOSE["volumes"] if "secret-" in name}
    assert set(names.split()) == secrets
    made = " ".join(re.findall(r"mkdir -p (.*?) *&&", LAST_STAGE)).split()
    assert {"/cache", "/health", "/work/runs"} <= set(made)


def test_one_image_on_a_base_of_ones_choice() -> None:
    (base,) = re.findall(r"^ARG BASE=(\S+)$", DOCKERFILE, re.M)
    assert re.fullmatch(r"python:3\.11-\S+@sha256:[0-9a-f]{64}", base), "by version and digest"
    assert {line.split()[1] for line in re.findall(r"^FROM .*$", DOCKERFILE, re.M)} == {"${BASE}"}
    (opengl,) = re.findall(r"^ARG GL=(\S+)$", DOCKERFILE, re.M)
    built = COMPOSE["services"]["prepare"]["build"]
    assert built["args"] == {"BASE": f"${{BASE:-{base}}}", "GL": f"${{GL:-{opengl}}}"}


def test_the_build_gets_every_package_and_the_scenarios() -> None:
    setup = PROJECT["tool"]["setuptools"]
    assert setup["packages"]["find"]["include"] == ["quadriga", "quadriga.*"]
    assert (TOP / "quadriga/deploy/scenarios").resolve() == TOP / "deploy/scenarios"
    linked = {path.name for path in (TOP / "quadriga").iterdir() if path.is_symlink()}
    packages = {"quadriga"} | linked
    files = {"deploy/scenarios"}  # a link of the package; experiments are not walked in an image
    ignore = (TOP / ".dockerignore").read_text(encoding="utf-8").splitlines()
    let_through = {line[1:] for line in ignore if line.startswith("!")}
    copied = {
        name
        for line in re.findall(r"^COPY (?!--)(.*) \S+$", DOCKERFILE, re.M)
        for name in line.split()
    }
    others = {"pyproject.toml", "LICENSE", "deploy/image.lock", "deploy/healthy.sh"}
    assert copied == let_through == packages | files | others
    assert all((TOP / name).exists() for name in copied)
