"""The containers against the project's own tables: no engine is needed to find them out of step."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from quadriga.commands.parser import build_parser
from quadriga.shared.config.load import load
from quadriga.shared.members import LAST, ROUTER
from quadriga.shared.robot.conventions import robot_names
from quadriga.team.launch import ProcessSpec, process_table

TOP = Path(__file__).parents[2]
COMPOSE: dict[str, Any] = yaml.safe_load((TOP / "docker-compose.yml").read_text(encoding="utf-8"))
SERVICES: dict[str, Any] = COMPOSE["services"]
DOCKERFILE = (TOP / "deploy/Dockerfile").read_text(encoding="utf-8")
TEAM = TOP / "deploy/team.toml"
CONFIG = load(TEAM)
ROWS = process_table(CONFIG, Path("/run"), Path("/run/predictor.npz"), "sha")


def arguments_of(service: str) -> Any:
    """What the command line makes of a service's command; the parser exits on a wrong one."""
    return build_parser().parse_args(SERVICES[service]["command"])


def mounts_of(service: str) -> dict[str, str]:
    """Source by target of a service's volumes."""
    entries = (re.sub(r"\$\{\w+:-(\w+)\}", r"\1", entry) for entry in SERVICES[service]["volumes"])
    return {entry.split(":")[1]: entry.split(":")[0] for entry in entries}


def environment() -> dict[str, str]:
    """The ENV of the image's last stage."""
    stage = DOCKERFILE[DOCKERFILE.rindex("FROM ") :].replace("\\\n", " ")
    return dict(re.findall(r"\b([A-Z_]+)=(\S+)", " ".join(re.findall(r"^ENV (.*)$", stage, re.M))))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_every_process_of_a_walk_has_a_service(row: ProcessSpec) -> None:
    verb = row.command.index("quadriga") + 1
    launched, contained = build_parser().parse_args(row.command[verb:]), arguments_of(row.name)
    assert contained.call is launched.call
    assert getattr(contained, "robot", None) == getattr(launched, "robot", None)


def test_no_service_is_left_over() -> None:
    assert SERVICES.keys() == {row.name for row in ROWS} | {"prepare", ROUTER}


def test_the_team_is_that_of_the_default_walk() -> None:
    assert CONFIG.team.robots == load().team.robots
    assert set(robot_names(CONFIG.team.robots)) <= SERVICES.keys()
    assert CONFIG.recorder.enabled


@pytest.mark.parametrize("service", SERVICES)
def test_all_read_the_one_configuration(service: str) -> None:
    mounted = mounts_of(service)[str(arguments_of(service).config)]
    assert (TOP / mounted).resolve() == TEAM


def test_the_team_meets_at_the_router() -> None:
    assert CONFIG.bus.mode == "client"
    assert CONFIG.bus.plaintext, (
        "without certificates, which the endpoint off the loopback must say"
    )
    _, host, port = re.split("[/:]", CONFIG.bus.endpoint)
    router = arguments_of(host)
    assert router.call is build_parser().parse_args(["router"]).call
    assert router.listen == f"tcp/0.0.0.0:{port}"
    assert router.once, "`docker compose up` would not return after the walk"


@pytest.mark.parametrize("service", sorted(SERVICES.keys() - {"prepare"}))
def test_nobody_starts_before_the_predictor_is_there(service: str) -> None:
    needs = SERVICES[service]["depends_on"]
    assert needs["prepare"] == {"condition": "service_completed_successfully"}
    assert {"prepare", "router"} <= reachable(service) | {service}


@pytest.mark.parametrize("service", ["recorder", *robot_names(CONFIG.team.robots)])
def test_who_needs_the_predictor_also_waits_by_itself(service: str) -> None:
    assert 60.0 <= arguments_of(service).wait <= CONFIG.bus.barrier_timeout


def test_the_recorder_hears_the_others_to_the_end() -> None:
    walkers = SERVICES.keys() - {"prepare", ROUTER, LAST}
    assert all(LAST in SERVICES[name]["depends_on"] for name in walkers)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_a_service_has_the_time_to_leave_that_its_process_has(row: ProcessSpec) -> None:
    assert float(SERVICES[row.name]["stop_grace_period"].removesuffix("s")) >= row.grace


def reachable(service: str) -> set[str]:
    """All that a service waits for, directly or not."""
    direct = set(SERVICES[service].get("depends_on", ()))
    return direct.union(*(reachable(name) for name in direct))


@pytest.mark.parametrize("service", SERVICES)
def test_predictor_and_compiled_code_are_shared(service: str) -> None:
    assert mounts_of(service)[environment()["XDG_CACHE_HOME"]] == "cache"
    assert "cache" in COMPOSE["volumes"]


def test_runs_outlive_their_container() -> None:
    workdir = re.findall(r"^WORKDIR (\S+)$", DOCKERFILE, re.M)[-1]
    assert mounts_of("recorder")[f"{workdir}/runs"] in COMPOSE["volumes"]
    assert arguments_of("recorder").output is None, "the default is runs/<date>-<time>"


@pytest.mark.parametrize("service", SERVICES)
def test_a_service_may_do_no_more_than_it_must(service: str) -> None:
    found = SERVICES[service]
    assert found["init"] is True, "signals reach the process and orphans are reaped"
    assert found["read_only"] is True
    assert found["cap_drop"] == ["ALL"]
    assert "no-new-privileges" in found["security_opt"]
    assert not found.keys() & {"network_mode", "privileged", "pid", "ipc", "ports", "cap_add"}


def test_nobody_is_root_in_the_image() -> None:
    user = re.findall(r"^USER (\d+):(\d+)$", DOCKERFILE, re.M)[-1]
    assert all(int(number) >= 1000 for number in user)


def test_one_image_on_a_base_of_ones_choice() -> None:
    (base,) = re.findall(r"^ARG BASE=(\S+)$", DOCKERFILE, re.M)
    assert re.fullmatch(r"python:3\.11-\S+@sha256:[0-9a-f]{64}", base), "by version and digest"
    assert {line.split()[1] for line in re.findall(r"^FROM .*$", DOCKERFILE, re.M)} == {"${BASE}"}
    built = {name for name, service in SERVICES.items() if "build" in service}
    assert built == {"prepare"}
    assert SERVICES["prepare"]["build"]["args"] == {"BASE": f"${{BASE:-{base}}}"}
    assert len({service["image"] for service in SERVICES.values()}) == 1


def test_no_service_pulls_an_image_that_somebody_else_could_have_made() -> None:
    policies = {name: service["pull_policy"] for name, service in SERVICES.items()}
    assert policies.pop("prepare") == "build"
    assert set(policies.values()) == {"never"}


@pytest.mark.parametrize("service", SERVICES)
def test_a_service_takes_no_more_of_the_machine_than_its_share(service: str) -> None:
    found = SERVICES[service]
    assert 0.0 < found["cpus"] <= 2.0, "more than a small machine has is refused"
    assert re.fullmatch(r"[1-4]g", found["mem_limit"])
    assert 0 < found["pids_limit"] <= 400


@pytest.mark.parametrize("service", SERVICES)
def test_a_service_reaches_nobody_but_the_team(service: str) -> None:
    assert SERVICES[service]["networks"] == ["team"]
    assert COMPOSE["networks"] == {"team": {"internal": True}}


def test_the_build_gets_every_package_and_the_scenarios() -> None:
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))
    setup = project["tool"]["setuptools"]
    assert setup["packages"]["find"]["include"] == ["quadriga", "quadriga.*"]
    linked = {path.name for path in (TOP / "quadriga").iterdir() if path.is_symlink()}
    packages = {"quadriga"} | linked
    files = {str(Path(name).parent) for names in setup["data-files"].values() for name in names}
    ignore = (TOP / ".dockerignore").read_text(encoding="utf-8").splitlines()
    let_through = {line[1:] for line in ignore if line.startswith("!")}
    copied = {
        name
        for line in re.findall(r"^COPY (?!--)(.*) \S+$", DOCKERFILE, re.M)
        for name in line.split()
    }
    assert copied == let_through == packages | files | {"pyproject.toml", "requirements.lock"}
    assert all((TOP / name).exists() for name in copied)
