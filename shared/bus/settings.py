"""Where a process listens and connects, whom it trusts there, and what Zenoh is told of it all."""

from __future__ import annotations

import re
import socket
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, NamedTuple

from quadriga.shared.bus.diagnostics import RECEIVE_BUFFER
from quadriga.shared.config.endpoints import check_exposure, check_port, host_and_port, is_tls
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import (
    BusError,
    ConfigError,
    QuadrigaError,
    name_file_errors,
    system_reason,
)
from quadriga.shared.members import LEADS, ROUTER
from quadriga.shared.runtime.clock import utc_now

NO_LINK: Final = "Unable to connect"  # how Zenoh says that nobody answers at an endpoint
LEASE_MS: Final = 10_000  # of silence after which a link is given up: its process stands still
# The others may start before the plant or the router: keep trying in the background.
_RETRY: Final = {"period_init_ms": 20, "period_max_ms": 200, "period_increase_factor": 1.5}
_COMMON: Final = {
    "transport/link/tx/lease": LEASE_MS,
    # Nobody is found by multicast, nothing goes through shared memory, and nothing is packed: it
    # could unpack to far more (zenoh issue 2589).
    "scouting/multicast/enabled": False,
    "transport/shared_memory/enabled": False,
    "transport/unicast/compression/enabled": False,
    # Batches that may wait for a link in real time before messages are dropped; with Zenoh's 2 a
    # recorder on a busy machine loses one in a thousand. A batch takes up to 64 kB. What is urgent
    # is sent at once (`express`), and has a queue of its own, which is empty nearly always.
    "transport/link/tx/queue/size/data": 16,
    "transport/link/tx/queue/size/real_time": 16,
    # Linux counts far more bytes of small messages than they have. Its own buffer is full after
    # 10 ms of a team that walks; then it throws packets away and sends them again 0.2 s later, or
    # later still: a recorder's link has stood still for 3 s. net.core.rmem_max caps this.
    "transport/link/tcp/so_rcvbuf": RECEIVE_BUFFER,
    "transport/link/tls/so_rcvbuf": RECEIVE_BUFFER,
    # ms, of a handshake with someone who says nothing, frozen or just leaving. Nobody can leave
    # before it is over, and Zenoh's 10 s are longer than a process is given.
    "transport/unicast/open_timeout": 2000,
    "transport/unicast/accept_timeout": 2000,
}

OPEN: Final = "open"  # something listens there
REFUSED: Final = "refused"  # the connection, or our certificate
UNREACHABLE: Final = "unreachable"
UNTRIED: Final = "untried"
_TIMEOUT: Final = 1.0  # s
_HANDSHAKE_TIMEOUT: Final = 2.0  # s, for the connection and for each answer
_VERDICT: Final = 0.3  # s, in which a listener that does not accept our certificate says so
_UNTRUSTED: Final = "untrusted"  # its certificate is another authority's, or for another address
_DATES: Final = {9: "not yet valid", 10: "expired"}  # by OpenSSL's codes
_CAUSES: Final = {
    NO_LINK: "is the router there (`quadriga router`), and does the name resolve?",
    "expired": "`quadriga certs renew router`, or a clock that is wrong",
    "not yet valid": "a clock that is wrong, here or where it was made",
    _UNTRUSTED: "another authority's, or the router was not made for this address: "
    "`quadriga certs make --router HOST`",
    REFUSED: "ours has expired or is another authority's: `quadriga certs show`",
}


def member_settings(bus: BusConfig, name: str, *, hub: bool = False) -> dict[str, Any]:
    """Zenoh's settings of a process of the team; only the configured endpoints are opened.

    In peer mode the process that drives time is who they all find, or who is the `hub`.

    Raises:
        ConfigError: the endpoint is open to others, or a certificate is missing.
    """
    peer = bus.mode == "peer"
    check_exposure(bus, "bus.endpoint", bus.endpoint)
    if peer:
        check_exposure(bus, "bus.listen", bus.listen)
    hub = peer and (hub or name in LEADS)
    listen = [bus.endpoint] if hub else [bus.listen] if peer else []
    return {
        "mode": bus.mode,
        "connect/endpoints": [] if hub else [bus.endpoint],
        "listen/endpoints": listen,
        "connect/exit_on_failure": False,
        "connect/timeout_ms": -1 if peer else 0,
        "connect/retry": _RETRY,
        "scouting/gossip/enabled": peer,
        **_COMMON,
        **_certificates(bus, bus.endpoint, name, listens=False),
    }


def router_settings(listen: str, bus: BusConfig, rules: Mapping[str, Any]) -> dict[str, Any]:
    """Zenoh's settings of the router that clients connect to at `listen`, by its rules of access.

    Raises:
        ConfigError: the endpoint is open to others, or a certificate is missing.
    """
    check_port("--listen", listen)
    check_exposure(replace(bus, mode="client"), "--listen", listen)
    return {
        "mode": "router",
        "connect/endpoints": [],
        "listen/endpoints": [listen],
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # Zenoh's 0.5 s, for nobody: a short walk is over meanwhile, unseen
        **_COMMON,
        **rules,
        **_certificates(bus, listen, ROUTER, listens=True),
    }


def _certificates(bus: BusConfig, endpoint: str, name: str, *, listens: bool) -> Mapping[str, Any]:
    if not is_tls(endpoint):
        return {}
    from quadriga.shared.security.certificates import tls_files, tls_settings

    return tls_settings(tls_files(bus.certificates, name), listens=listens)


def opening_error(settings: dict[str, Any], at: str, name: str, error: str) -> BusError:
    """The error of a process `name` that cannot join the network, out of Zenoh's words.

    Zenoh often does not say which setting is wrong: `at` is the last that was set.
    """
    connect, listen = settings["connect/endpoints"], settings["listen/endpoints"]
    key, endpoint = "bus.endpoint", (connect or listen)[0]
    # Who listens too connects in the background: only the form and the protocol are checked before.
    protocol = f"not supported for {endpoint.partition('/')[0]} protocol"
    if connect and listen and at != "connect/endpoints" and protocol not in error:
        key, endpoint = "bus.listen", listen[0]
    if "in use" in error:
        cause = "another team or program listens there; choose another port"
    elif NO_LINK in error:
        cause = "no router there (`quadriga router`), or a name that does not resolve"
    elif "assign" in error:
        cause = "no interface of this machine has that address; without IPv4, give [::1]"
    else:
        cause = "a name that does not resolve, or not of the form tcp/HOST:PORT"
    where = "sim server" if name in LEADS else name
    got, expected = error.split(" at /")[0], "an endpoint that can be opened"
    return BusError(f"{key} {endpoint!r} of {where}", got, expected, cause)


class Reach(NamedTuple):
    """What came of the attempt to connect: one of the codes of this module, and it in words."""

    code: str
    text: str


def try_endpoint(endpoint: str, timeout: float = _TIMEOUT) -> Reach:
    """Connect to an endpoint and close again, without a word.

    That something listens there does not mean that it is Zenoh, nor, with TLS, that it trusts this
    computer: only a handshake tells that.
    """
    try:  # Zenoh's form: protocol/HOST:PORT, with settings of its own behind ? or #
        host, port = host_and_port(re.split("[?#]", endpoint)[0])
    except ConfigError:
        host, port = "", 0
    if not host or not endpoint.startswith(("tcp/", "tls/")):
        return Reach(UNTRIED, f"{endpoint} was not tried: only tcp and tls can be")
    try:
        socket.create_connection((host, port), timeout).close()
    except (ConnectionRefusedError, ConnectionResetError):
        return Reach(REFUSED, f"nobody listens at {endpoint}")
    except TimeoutError:
        why = "it is off, in another network, or behind a firewall"
        return Reach(UNREACHABLE, f"{host} does not answer within {timeout:g} s: {why}")
    except OSError as error:
        return Reach(UNREACHABLE, f"{endpoint} cannot be reached: {error}")
    return Reach(OPEN, f"something listens at {endpoint}")


def check_trust(bus: BusConfig, name: str) -> None:
    """Whether process `name` and the router trust each other, if they ask for it: tried once.

    Zenoh takes who is not trusted for one that is not there yet, and tries for ever.

    Raises:
        BusError: nobody answers, or one does not trust the other; it says who and why.
        ConfigError: a certificate is missing or cannot be used.
    """
    if not is_tls(bus.endpoint):
        return
    import ssl

    from quadriga.shared.security.certificates import NOT_YET_VALID, read_certificate, tls_files

    def error(outcome: str, detail: str) -> BusError:
        where, expected = f"bus.endpoint {bus.endpoint!r} of {name}", "a router that is trusted and"
        got, cause = f"{outcome}: {detail}", _CAUSES[outcome]
        return BusError(where, got, f"{expected} trusts this process", cause)

    host, port = host_and_port(bus.endpoint)
    files, context = tls_files(bus.certificates, name), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    folder, expected = files.certificate.parent, "a certificate, its key, the authority's"
    with name_file_errors(ConfigError, folder, expected, "`quadriga certs show`"):
        context.load_verify_locations(files.authority)
        context.load_cert_chain(files.certificate, files.key)
    held, now = read_certificate(files.certificate), utc_now()
    if held.state(now) == NOT_YET_VALID:  # the other side would say that it has expired
        raise error(NOT_YET_VALID, f"ours is from {held.begins:%F %T} on, now is {now:%F %T}")
    try:
        with (
            socket.create_connection((host, port), _HANDSHAKE_TIMEOUT) as link,
            context.wrap_socket(link, server_hostname=host) as secured,
        ):
            # Who does not accept our certificate says so after the handshake; silence is consent.
            secured.settimeout(_VERDICT)
            try:
                hung_up = not secured.recv(1)
            except TimeoutError:
                return
        if hung_up:
            raise error(REFUSED, "it hung up")
    except ssl.SSLCertVerificationError as problem:
        outcome = _DATES.get(problem.verify_code, _UNTRUSTED)
        raise error(outcome, problem.verify_message) from None
    except ssl.SSLError as problem:
        text = problem.reason or str(problem)
        raise error(REFUSED, text.lower().replace("_", " ")) from None
    except ConnectionResetError:
        raise error(REFUSED, "it hung up") from None
    except OSError as problem:
        raise error(NO_LINK, system_reason(problem)) from None


def describe_way(bus: BusConfig, name: str) -> str:
    """How `bus.endpoint` is reached from here by process `name`; takes seconds if nobody answers.

    Zenoh itself never says why there is no link.
    """
    if not is_tls(bus.endpoint):
        return try_endpoint(bus.endpoint).text
    try:
        check_trust(bus, name)
    except QuadrigaError as error:
        return f"{error.name}: {error.got} ({error.cause})"
    return f"the router at {bus.endpoint} and {name} trust each other"
