"""Lines of Zenoh 1.10's log: which of them tell that somebody was refused something."""

from __future__ import annotations

import pytest

from quadriga.shared.security.refusals import RefusalParser, Refused

ONE, TWO = "29a8f12d130c0a69d0b4355a58008dfc", "4d6341e01f894aa2fe81b1531d4ab363"
ACCESS = "zenoh::net::routing::interceptor::access_control"


def line(thread: int, text: str, module: str = ACCESS) -> str:
    return f"2026-11-26T01:17:32.320045Z TRACE  rx-0 ThreadId({thread:02}) {module}: {text}"


def verdict(thread: int, session: str, words: str, key: str) -> str:
    name = f"{session} on CertCommonName(r2.1)+Transport(Tls)+{session}"
    return line(thread, f"{name} is {words} on {key}")


def dropped(thread: int) -> str:
    return line(thread, "Msg intercepted!", "zenoh::net::routing::interceptor")


def take(*lines: str) -> dict[Refused, int]:
    return dict(RefusalParser().take(lines))


def test_a_verdict_is_no_refusal_before_the_message_is_dropped() -> None:
    words = "unauthorized to Put (ingress)"
    assert take(verdict(8, ONE, words, "team/r1/command")) == {}
    assert take(verdict(8, ONE, words, "team/r1/command"), dropped(8)) == {
        Refused(ONE, "put", "team/r1/command", "denied"): 1
    }


def test_the_last_verdict_before_it_counts() -> None:
    """Of a key that is declared Zenoh notes beforehand what would be refused."""
    assert take(
        verdict(8, ONE, "unauthorized to Query (ingress)", "team/r1/state"),
        verdict(8, ONE, "unauthorized to Declare/Undeclare Subscriber (ingress)", "team/r1/state"),
        line(
            8,
            f"Using cached result: {ONE} is unauthorized to Declare Subscriber (ingress) "
            "on team/r1/state",
        ),
        dropped(8),
    ) == {Refused(ONE, "declare subscriber", "team/r1/state", "denied"): 1}


def test_threads_are_told_apart_and_one_drop_has_one_verdict() -> None:
    put = "unauthorized to Put (ingress)"
    verdicts = verdict(8, ONE, put, "team/a"), verdict(9, TWO, put, "team/b")
    assert take(*verdicts, dropped(8), dropped(9), dropped(8)) == {
        Refused(ONE, "put", "team/a", "denied"): 1,
        Refused(TWO, "put", "team/b", "denied"): 1,
    }


def test_who_may_send_it_but_is_dropped_has_sent_too_much() -> None:
    cached = f"Using cached result: {ONE} is authorized to Put (ingress) on team/r2/command"
    assert take(line(8, cached), dropped(8)) == {Refused(ONE, "put", "team/r2/command", "large"): 1}


def test_what_is_sent_to_somebody_who_has_just_left_is_not_refused() -> None:
    """Zenoh drops it without a verdict, right after the message to another receiver, or ahead."""
    queries = "zenoh::net::routing::dispatcher::queries"
    came = verdict(8, ONE, "authorized to Query (ingress)", "team/*/received")
    routed = line(8, "south:0:client/29a8f12d:1:4 Route query for res team/*/received", queries)
    out = verdict(8, TWO, "authorized to Query (egress)", "team/*/received")
    assert take(came, routed, out, dropped(8)) == {}
    assert take(came, routed, dropped(8)) == {}
    assert take(verdict(8, TWO, "authorized to Put (egress)", "team/r1/state"), dropped(8)) == {}
    assert take(came, dropped(8)) == {Refused(ONE, "query", "team/*/received", "large"): 1}
    denied = verdict(8, TWO, "unauthorized to Put (egress)", "team/r1/state")
    assert take(denied, dropped(8)) == {Refused(TWO, "hear", "team/r1/state", "denied"): 1}


def test_what_comes_too_often_names_the_beginning_of_a_session() -> None:
    text = (
        "Message dropped by the downsampling interceptor: Push(team/r2/command) "
        "from:south:0:client/29a8f12d:2"
    )
    module = "zenoh::net::routing::interceptor::downsampling"
    assert take(line(8, text, module), dropped(8)) == {
        Refused("29a8f12d", "put", "team/r2/command", "often"): 1
    }


def test_a_link_that_is_not_accepted_is_told_with_its_reason() -> None:
    hint = "invalid peer certificate: BadSignature. Hint: increase the system open file limit."
    assert take(line(5, hint, "zenoh_link_tls::unicast")) == {
        Refused("somebody", "connect: invalid peer certificate: BadSignature", "", "untrusted"): 1
    }


def test_when_it_was_verified_does_not_make_another_kind() -> None:
    lines = [
        f"invalid peer certificate: certificate expired: verification time {k} (UNIX), but "
        f"certificate is not valid after 5 ({k} seconds ago). Hint: increase the system open file "
        "limit."
        for k in (7, 8)
    ]
    why = "connect: invalid peer certificate: certificate expired"
    assert take(*(line(5, text, "zenoh_link_tls::unicast") for text in lines)) == {
        Refused("somebody", why, "", "untrusted"): 2
    }


@pytest.mark.parametrize("form", ["tls/127.0.0.2:7447 => tls/{}", "127.0.0.2:7447 => {}"])
def test_a_link_that_expires_is_told_with_whose_it_was(form: str) -> None:
    accepted = [
        f"Accepted TLS connection on 127.0.0.2:7447: 127.0.0.1:{port}. Common Name: {name}."
        for name, port in (("r1.1", 53748), ("r2.1", 53749))
    ]
    closed = f"Closing TLS link {form.format('127.0.0.1:53748')} : remote certificate chain expired"
    assert take(
        *(line(5, text, "zenoh_link_tls::unicast") for text in accepted),
        line(7, closed, "zenoh_link_commons::tls::expiration"),
    ) == {Refused("r1.1", "stay connected", "", "expired"): 1}
    assert take(line(7, closed, "zenoh_link_commons::tls")) == {
        Refused("somebody", "stay connected", "", "expired"): 1
    }


def test_a_session_too_many_is_told_with_whose_certificate_it_has() -> None:
    accepted = "Accepted TLS connection on 127.0.0.2:7447: 127.0.0.1:53748. Common Name: r1.1."
    denied = f"Max transports reached (19). Denying new transport with peer: {ONE} at /x.rs:629."
    assert take(
        line(5, accepted, "zenoh_link_tls::unicast"),
        line(5, denied, "zenoh_transport::unicast::manager"),
    ) == {Refused("r1.1", "connect", "", "full"): 1}


def test_colours_do_not_matter() -> None:
    coloured = dropped(8).replace("TRACE", "\x1b[35mTRACE\x1b[0m")
    put = verdict(8, ONE, "unauthorized to Put (ingress)", "team/a")
    assert len(take(put.replace(ACCESS, f"\x1b[2m{ACCESS}\x1b[0m\x1b[2m"), coloured)) == 1


def test_of_a_long_key_only_the_beginning_is_read() -> None:
    """What somebody calls a key must not hold up who reads the log."""
    key = "a" * 65_000
    (found,) = take(verdict(8, ONE, "unauthorized to Put (ingress)", key), dropped(8))
    assert (found.who, found.reason) == (ONE, "denied")
    assert key.startswith(found.key)
    assert len(found.key) < 1000
