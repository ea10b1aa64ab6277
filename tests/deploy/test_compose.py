"""The containers against the project's own tables: no engine is needed to find them out of step."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from quadriga.commands.parser import build_parser
from quadriga.shared.config.endpoints import host_and_port, is_tls
from quadriga.shared.config.load import load
from quadriga.shared.members import DOCTOR, ESTOP, LAST, OBSERVER, RESET, RESUME, ROUTER, STOP
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.security.access import team_identities
from quadriga.team.launch import process_table

TOP = Path(__file__).parents[2]
FILE = TOP / "docker-compose.yml"
COMPOSE: dict[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
SERVICES: dict[str, Any] = COMPOSE["services"]
TEAM = TOP / "deploy/team.toml"
MOST = 5  # robots
CONFIG = load(TEAM, {"team.robots": MOST, "planner.kind": "centralised"})
ROWS = process_table(CONFIG, Path("/run"), Path("/run/predictor.npz"), "sha")
ONCE = ("certs", "prepare")  # services that do something before the walk
VIEW = "view"  # looks on: nobody waits for it, and it is not of the team
ON_THE_BUS = sorted(SERVICES.keys() - {*ONCE, "replay", VIEW})


def resolve(text: str, **variables: str) -> str:
    """What Compose makes of a text with variables such as `${NAME:-default}`."""
    return re.sub(r"\$\{(\w+):-([^}]*)\}", lambda m: variables.get(m[1], m[2]), text)


def arguments_of(service: str, **variables: str) -> Any:
    """What the command line makes of a service's command; the parser exits on a wrong one."""
    found = SERVICES[service]
    words = [*found.get("entrypoint", ["quadriga"])[1:], *found["command"]]
    return build_parser().parse_args([resolve(word, **variables) for word in words])


def mounts_of(service: str) -> dict[str, str]:
    """Source by target of a service's volumes."""
    entries = [resolve(entry) for entry in SERVICES[service]["volumes"]]
    return {entry.split(":")[1]: entry.split(":")[0] for entry in entries}


def secrets_of(service: str) -> set[str]:
    """Whose certificates a service sees."""
    return {Path(target).name for target in mounts_of(service) if target.startswith("/secrets/")}


def started(size: int) -> set[str]:
    """The services that `docker compose up` starts with TEAM_SIZE."""
    line = (TOP / ".env").read_text(encoding="utf-8").splitlines()[-1]
    profiles = resolve(line.removeprefix("COMPOSE_PROFILES="), TEAM_SIZE=str(size)).split(",")
    return {
        name
        for name, service in SERVICES.items()
        if not service.get("profiles") or set(service["profiles"]) & set(profiles)
    }


def test_the_file_is_as_the_compose_specification_wants_it(tmp_path: Path) -> None:
    """By the specification's schema, which comes with the checker and finds a mistake."""
    wrong = tmp_path / "docker-compose.yml"
    text = FILE.read_text(encoding="utf-8").replace("stop_grace_period:", "stop_grace_time:")
    wrong.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]
    for file, status in ((FILE, 0), (wrong, 1)):
        done = subprocess.run([*command, file], capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stdout + done.stderr
    assert "stop_grace_time" in done.stdout


def test_there_is_one_image_of_this_version_that_only_this_file_builds() -> None:
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    name = f"quadriga:{project['version']}"
    assert {resolve(found["image"]) for found in SERVICES.values()} == {name}
    assert f"-t {name} ." in (TOP / "deploy/Dockerfile").read_text(encoding="utf-8")
    policies = {name: service["pull_policy"] for name, service in SERVICES.items()}
    assert policies.pop("prepare") == "build"
    assert set(policies.values()) == {"never"}
    assert {name for name, service in SERVICES.items() if "build" in service} == {"prepare"}


@pytest.mark.parametrize("size", range(1, MOST + 1))
def test_team_size_starts_that_many_agents_and_tells_everybody(size: int) -> None:
    around = {*ONCE, "router", "doctor", "recorder", "sim", "operator"}
    assert started(size) == {*robot_names(size), *around}
    for name in started(size):
        assert vars(arguments_of(name, TEAM_SIZE=str(size)))["team.robots"] == size


def test_every_process_of_a_walk_has_a_service_and_its_time_to_leave() -> None:
    for row in ROWS:
        verb = row.command.index("quadriga") + 1
        launched = build_parser().parse_args(row.command[verb:])
        contained = arguments_of(row.name)
        assert contained.call is launched.call
        assert getattr(contained, "robot", None) == getattr(launched, "robot", None)
        grace = SERVICES[row.name]["stop_grace_period"]
        assert float(grace.removesuffix("s")) >= row.grace, row.name
    assert set(ON_THE_BUS) == {row.name for row in ROWS} | {ROUTER, DOCTOR}


def test_the_team_is_that_of_the_default_walk() -> None:
    config = load(TEAM)
    assert config.team.robots == load().team.robots
    assert resolve("${TEAM_SIZE:-3}") == str(config.team.robots)
    assert len(started(config.team.robots) & set(robot_names(MOST))) == config.team.robots
    assert config.recorder.enabled
    for service in (*ONCE, *ON_THE_BUS, VIEW):
        mounted = mounts_of(service)[str(arguments_of(service).config)]
        assert (TOP / mounted).resolve() == TEAM, "all read the one configuration"


def test_the_team_meets_at_the_router_with_certificates() -> None:
    assert CONFIG.bus.mode == "client"
    assert not CONFIG.bus.plaintext
    host, port = host_and_port(CONFIG.bus.endpoint)
    router = arguments_of(host)
    assert router.call is build_parser().parse_args(["router"]).call
    assert router.listen == f"tls/0.0.0.0:{port}"
    assert is_tls(CONFIG.bus.endpoint)
    assert router.once, "`docker compose up` would not return after the walk"
    assert arguments_of("certs").hosts == [host]


@pytest.mark.parametrize("service", [*ON_THE_BUS, VIEW])
def test_a_service_sees_its_own_certificates_and_cannot_change_them(service: str) -> None:
    several = {"operator": {"operator", ESTOP, STOP, RESET, RESUME}, VIEW: {OBSERVER}}
    own = several.get(service, {service})
    assert secrets_of(service) == own
    entries = [entry for entry in SERVICES[service]["volumes"] if "/secrets/" in entry]
    assert set(entries) == {f"secret-{name}:/secrets/{name}:ro" for name in own}


def test_certificates_are_made_for_all_and_only_their_maker_has_the_authority() -> None:
    assert CONFIG.bus.certificates == "/secrets"
    assert mounts_of("certs")["/secrets"] == "secret-authority"
    assert secrets_of("certs") == {
        name for other in (*ON_THE_BUS, VIEW) for name in secrets_of(other)
    }
    assert secrets_of("certs") <= {who.name for who in team_identities(CONFIG)}
    held = [name for name in SERVICES if "secret-authority" in mounts_of(name).values()]
    assert held == ["certs"]


def reachable(service: str) -> set[str]:
    """All that a service waits for, directly or not."""
    direct = set(SERVICES[service].get("depends_on", ()))
    return direct.union(*(reachable(name) for name in direct))


def test_services_start_in_their_order() -> None:
    done = {"condition": "service_completed_successfully"}
    assert SERVICES[ROUTER]["depends_on"] == dict.fromkeys(ONCE, done)
    for service in {*ON_THE_BUS} - {ROUTER}:
        assert ROUTER in reachable(service), "nobody starts before the router"
        # Podman would run again those that run once, for each who names them.
        assert not {*ONCE} & SERVICES[service]["depends_on"].keys()
    for service in ("recorder", "planner", *robot_names(MOST)):  # who needs the predictor
        assert 60.0 <= arguments_of(service).wait <= CONFIG.bus.barrier_timeout
    walkers = set(ON_THE_BUS) - {ROUTER, LAST, DOCTOR}
    assert all(LAST in SERVICES[name]["depends_on"] for name in walkers), "it hears all to the end"


@pytest.mark.parametrize("service", ON_THE_BUS)
def test_healthy_is_who_the_doctor_has_found_well(service: str) -> None:
    """It writes a file for each process; to read it starts no Python."""
    check = SERVICES[service]["healthcheck"]
    assert check["test"] == ["CMD", "healthy", service]
    assert str(arguments_of(DOCTOR).watch) == "/health"
    (entry,) = [entry for entry in SERVICES[service]["volumes"] if entry.startswith("health:")]
    expected = "health:/health" if service == DOCTOR else "health:/health:ro"
    assert entry == expected, "nobody but the doctor can say so"
    assert float(check["start_period"].removesuffix("s")) >= CONFIG.bus.barrier_timeout


def test_the_view_is_reached_from_this_computer_alone_and_keeps_nobody_waiting() -> None:
    view = arguments_of(VIEW)
    (published,) = SERVICES[VIEW]["ports"]
    assert resolve(published) == f"127.0.0.1:8090:{view.port}"
    assert view.host == "0.0.0.0"  # of its container
    assert view.once, "`docker compose up` would not return after the walk"
    assert [name for name, service in SERVICES.items() if "ports" in service] == [VIEW]


def test_volumes_are_shared_and_outlive_their_containers() -> None:
    for service in SERVICES.keys() - {"certs"}:
        assert mounts_of(service)["/cache"] == "cache", "predictor and compiled code"
    for service in ("recorder", "replay"):
        assert mounts_of(service)["/work/runs"] == "runs"
    assert arguments_of("recorder").output is None, "the default is runs/<date>-<time>"
    sources = {source for name in SERVICES for source in mounts_of(name).values()}
    assert {source for source in sources if not source.startswith(".")} == COMPOSE["volumes"].keys()


@pytest.mark.parametrize("service", SERVICES)
def test_a_service_may_do_and_take_and_reach_no_more_than_it_must(service: str) -> None:
    found = SERVICES[service]
    assert found["init"] is True, "signals reach the process and orphans are reaped"
    assert found["read_only"] is True
    assert found["cap_drop"] == ["ALL"]
    assert "no-new-privileges" in found["security_opt"]
    assert not found.keys() & {"privileged", "pid", "ipc", "cap_add", "user"}
    assert 0.0 < found["cpus"] <= 2.0, "more than a small machine has is refused"
    assert re.fullmatch(r"[1-4]g", found["mem_limit"])
    assert 0 < found["pids_limit"] <= 400
    if service in (*ON_THE_BUS, VIEW):
        assert found["networks"] == (["team", "page"] if service == VIEW else ["team"])
        assert "network_mode" not in found
    else:
        assert found["network_mode"] == "none"
    assert COMPOSE["networks"] == {"team": {"internal": True}, "page": {}}
