"""Whether an endpoint of mutual TLS is reached and trusted, and trusts us; if not, why.

Zenoh takes a link that is not trusted for one that is not there yet, and tries for ever.
"""

from __future__ import annotations

import socket
import ssl
from dataclasses import dataclass
from typing import Final

from quadriga.shared.config.endpoints import host_and_port
from quadriga.shared.errors import ConfigError, system_reason
from quadriga.shared.runtime.clock import utc_now
from quadriga.shared.security.certificates import EXPIRED, NOT_YET_VALID, TlsFiles, read_certificate

TRUSTED: Final = "trusted"
UNREACHABLE: Final = "unreachable"  # nobody answers there
UNTRUSTED: Final = "untrusted"  # its certificate is of another authority, or for another address
REFUSED: Final = "refused"  # it does not accept ours

_TIMEOUT: Final = 2.0  # s, for the connection and for each answer
# s, in which a listener that does not accept our certificate says so, after the handshake.
_VERDICT: Final = 0.3
_DATES: Final = {9: NOT_YET_VALID, 10: EXPIRED}  # OpenSSL's codes
CAUSES: Final = {
    UNREACHABLE: "is the router there (`quadriga router`), and does the name resolve?",
    EXPIRED: "`quadriga certs renew router`, or a clock that is wrong",
    NOT_YET_VALID: "a clock that is wrong, here or where it was made",
    UNTRUSTED: "another authority's, or the router was not made for this address: "
    "`quadriga certs make --router HOST`",
    REFUSED: "ours has expired or is another authority's: `quadriga certs show`",
}


@dataclass(frozen=True, slots=True)
class Handshake:
    """What came of one: one of the words above, and what the system says of it."""

    outcome: str
    detail: str = ""


def shake_hands(endpoint: str, files: TlsFiles) -> Handshake:
    """Try an endpoint once, and leave.

    Args:
        endpoint: `tls/HOST:PORT`.
        files: what this process shows and trusts.

    Raises:
        ConfigError: the endpoint is malformed, or the files cannot be used.
    """
    host, port = host_and_port(endpoint)
    context, now, held = _context(files), utc_now(), read_certificate(files.certificate)
    if held.state(now) == NOT_YET_VALID:  # the other side would say that it has expired
        return Handshake(NOT_YET_VALID, f"ours is from {held.begins:%F %T} on, now is {now:%F %T}")
    try:
        with (
            socket.create_connection((host, port), _TIMEOUT) as link,
            context.wrap_socket(link, server_hostname=host) as secured,
        ):
            return _await_verdict(secured)
    except ssl.SSLCertVerificationError as error:
        return Handshake(_DATES.get(error.verify_code, UNTRUSTED), error.verify_message)
    except ssl.SSLError as error:
        return Handshake(REFUSED, (error.reason or str(error)).lower().replace("_", " "))
    except ConnectionResetError:
        return Handshake(REFUSED, "it hung up")
    except OSError as error:
        return Handshake(UNREACHABLE, system_reason(error))


def _await_verdict(secured: ssl.SSLSocket) -> Handshake:
    """What the listener says of our certificate once it has seen it; silence is consent."""
    secured.settimeout(_VERDICT)
    try:
        return Handshake(TRUSTED) if secured.recv(1) else Handshake(REFUSED, "it hung up")
    except TimeoutError:
        return Handshake(TRUSTED)


def _context(files: TlsFiles) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # TLS 1.2 at least
    try:
        context.load_verify_locations(files.authority)
        context.load_cert_chain(files.certificate, files.key)
    except OSError as error:  # of ssl's own kind too
        folder, expected = str(files.certificate.parent), "a certificate, its key, the authority's"
        raise ConfigError(folder, system_reason(error), expected, "`quadriga certs show`") from None
    return context
