"""The bus: a session of Zenoh with publishers, one inbox, tokens. The only import of zenoh."""

from __future__ import annotations

import ctypes
import json
import os
import sys
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from queue import SimpleQueue
from types import MappingProxyType
from typing import Any, Final, Self

import zenoh

from quadriga.shared.about import HERE as HERE
from quadriga.shared.about import READY as READY
from quadriga.shared.bus.ring_buffer import Mailbox
from quadriga.shared.bus.settings import (
    NO_LINK,
    check_trust,
    member_settings,
    opening_error,
    router_settings,
)
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError
from quadriga.shared.members import ROUTER
from quadriga.shared.runtime.clock import monotonic, monotonic_ns, sleep, wall_ns
from quadriga.shared.topics import RECEIVED

Packet = tuple[str, bytes]  # key, payload as received
Arrival = tuple[int, str, bytes]  # when, ns of `monotonic_ns`, and the packet
Answer = tuple[int, str, bytes]  # when, ns of the wall clock, and key and payload

_INBOX: Final = 1 << 16  # packets that wait for a process at most, some seconds of ten robots
POLL: Final = 0.05  # s, longest wait before a loop looks at its stop flag
_ACK_TIMEOUT: Final = 2.0  # s
_LINK_TIMEOUT: Final = 5.0  # s
_WAITS, _DROPS = zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP
# A member receives in one thread: each message is handed over to Python, which one thread at a time
# can do. Zenoh reads this when a process opens its first session.
_THREADS: Final = "ZENOH_RUNTIME"
_ONE_RECEIVES: Final = "(rx: (worker_threads: 1), acc: (handover: rx), net: (handover: rx))"


def pause() -> None:
    """Some milliseconds until the next look."""
    sleep(0.005)


class Answers:
    """The answers to one question; a thread that receives them adds to it, another one reads it.

    Attributes:
        asked_ns: when the question was asked, by the wall clock.
        over: whether nothing more will come: all who can answer have, or the time is over.
        came: what has come, oldest first.
    """

    def __init__(self) -> None:
        self.asked_ns, self.over, self.came = wall_ns(), False, list[Answer]()

    def note(self, reply: zenoh.Reply) -> None:
        """An answer has come."""
        if reply.ok is not None:
            self.came.append((wall_ns(), *_packet(reply.ok)))

    def end(self) -> None:
        """Nothing more will come."""
        self.over = True


class Bus:
    """One process's connection to its team.

    Every subscription feeds one inbox, so a process waits in one place. Presence is a liveliness
    token `<team>/<name>/<stage>/<session>`: it vanishes within milliseconds when its process dies,
    and the session in it tells two processes of the same name apart. A process's last packets may
    arrive after its token has vanished.
    """

    def __init__(self, session: zenoh.Session, team: str, name: str) -> None:
        """Use `Bus.open`."""
        self.team, self.name = team, name
        self._session = session
        self._me = str(session.info.zid())
        self._inbox: Mailbox[zenoh.Sample] = Mailbox(_INBOX)
        self._tokens: set[tuple[str, str, str]] = set()  # of others: name, stage, session
        self._declared: dict[str, zenoh.LivelinessToken] = {}
        self._closed = False
        tokens, ack = f"{team}/*/*/*", f"{team}/{name}/{RECEIVED}"
        # Zenoh drops publishers and subscribers nobody refers to.
        self._declarations: list[Any] = [
            session.liveliness().declare_subscriber(
                tokens, _direct(self._note_token), history=True
            ),
            session.declare_queryable(ack, _direct(lambda query: query.reply(ack, b""))),
        ]

    @classmethod
    def open(
        cls, bus: BusConfig, team: str, name: str, stopped: Callable[[], bool] | None = None
    ) -> Self:
        """Join the network as process `name` of `team`.

        In peer mode the process that drives time listens on `bus.endpoint`; all others connect,
        now or when it appears, and learn of each other through it, so that links are direct.
        In client mode the router must be there, or appear within `bus.barrier_timeout` if
        `stopped` is given.

        Raises:
            ConfigError: the endpoint is open to others, or a certificate is missing.
            BusError: the endpoint is malformed, cannot be bound, or is already in use; or there
                is no router, or it and this process do not trust each other.
            KeyboardInterrupt: `stopped()` came before the router.
        """
        settings, waits = member_settings(bus, name), False
        deadline = monotonic() + (bus.barrier_timeout if stopped else 0.0)
        while True:
            try:
                check_trust(bus, name)
                return cls(_open(settings, name), team, name)
            except BusError as error:
                if stopped is None or NO_LINK not in error.got or monotonic() > deadline:
                    raise
            if stopped():
                raise KeyboardInterrupt
            if not waits:
                waits = True
                text = f"quadriga: {name} waits for a router at {bus.endpoint}"
                print(text, file=sys.stderr, flush=True)
            sleep(POLL)

    @classmethod
    def join(cls, bus: BusConfig, team: str, name: str) -> Self:
        """Join the network at `bus.endpoint`; in peer mode be who listens there if nobody does.

        For a process that must be found although no plant runs. If somebody listens there,
        this waits for the link to them. It raises what `open` does.
        """
        if bus.mode == "peer":
            with suppress(BusError):  # somebody listens there, or it is another machine's
                return cls(_open(member_settings(bus, name, hub=True), name), team, name)
        joined = cls.open(bus, team, name)
        joined.wait_for_link(_LINK_TIMEOUT)
        return joined

    @classmethod
    def route(
        cls,
        listen: str,
        team: str,
        bus: BusConfig | None = None,
        rules: Mapping[str, Any] = MappingProxyType({}),
    ) -> Self:
        """Be the router through which the processes in client mode reach each other.

        It passes on what any team sends, by default everything, and sees the presence of `team`.
        `tls/0.0.0.0:PORT` accepts other machines. It raises what `open` does.
        """
        settings = router_settings(listen, bus or BusConfig(), rules)
        return cls(_open(settings, ROUTER), team, ROUTER)

    @property
    def linked(self) -> bool:
        """Whether anyone is linked to this process at the moment."""
        return bool(self._session.info.links())

    def wait_for_link(self, timeout: float, stopped: Callable[[], bool] = lambda: False) -> None:
        """Wait until anyone is linked, for `timeout` seconds at most, or until `stopped()`."""
        deadline = monotonic() + timeout
        while not (self.linked or stopped()) and monotonic() < deadline:
            pause()

    def publisher(
        self, key: str, *, waits: bool = True, urgent: bool = False
    ) -> Callable[[bytes], None]:
        """A function that sends a payload on `key`.

        Args:
            key: the full key, `<team>/…`.
            waits: wait for whoever is slow, and keep everybody waiting with a router; else who is
                slow misses some.
            urgent: for what people say and what happens: it waits for nobody, overtakes all else.
                So it gets through a router whose other queues are full since somebody is frozen.
        """
        publisher = self._session.declare_publisher(
            key,
            express=urgent,  # see `_COMMON` of the settings
            congestion_control=_WAITS if waits and not urgent else _DROPS,
            priority=zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.DATA,
        )
        self._declarations.append(publisher)
        put: Callable[[bytes], None] = publisher.put
        return put

    def subscribe(self, key: str) -> None:
        """Feed what others publish on `key` (may hold `*` and `**`) into the inbox."""
        self._hear(key, _direct(self._inbox.put))

    def hear(self, key: str, call: Callable[[bytes], None]) -> None:
        """Have `call` take what others publish on `key`: in the receiving thread, quick."""
        self._hear(key, _direct(lambda sample: call(sample.payload.to_bytes())))

    @property
    def dropped(self) -> int:
        """Packets that were dropped so far because this process did not take them in."""
        return self._inbox.dropped

    def collect(self, *keys: str) -> Callable[[], list[Arrival]]:
        """Keep what others publish on `keys` apart from the inbox, each with when it was received.

        The function returned gives all that have come since it was called last, oldest first.
        """
        kept: SimpleQueue[Arrival] = SimpleQueue()
        for key in keys:
            self._hear(key, _direct(lambda sample: kept.put((monotonic_ns(), *_packet(sample)))))
        return lambda: [kept.get_nowait() for _ in range(kept.qsize())]

    def keep_newest(self, key: str) -> Callable[[], bytes | None]:
        """Keep the newest of what others publish on `key`, apart from the inbox.

        The function returned gives it once, None if nothing has come since. Zenoh keeps it, so that
        what nobody looks at costs this process nothing.
        """
        kept = self._hear(key, zenoh.handlers.RingChannel(1))

        def take() -> bytes | None:
            sample = kept.try_recv()
            return None if sample is None else sample.payload.to_bytes()

        return take

    def answer(self, key: str, call: Callable[[], bytes]) -> None:
        """Answer who asks on `key` with `call()`: in the receiving thread, quick, never raising."""
        answering = _direct(lambda query: query.reply(key, call()))
        self._declarations.append(self._session.declare_queryable(key, answering))

    def ask(self, key: str, timeout: float) -> Answers:
        """Ask all who answer on `key` (may hold `*`) and do not wait for them.

        Answers come for `timeout` seconds at most; who is frozen gives none. This process answers
        its own question, too.
        """
        answers = Answers()
        self._session.get(
            key,
            zenoh.handlers.Callback(answers.note, answers.end, indirect=False),
            target=zenoh.QueryTarget.ALL,
            timeout=timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
            express=True,
            congestion_control=_DROPS,  # who is frozen holds up nobody
        )
        return answers

    def get(self, timeout: float) -> Packet | None:
        """The oldest packet of the inbox, waiting at most `timeout` seconds for one."""
        sample = self._inbox.take(timeout)
        return None if sample is None else _packet(sample)

    def drain(self) -> list[Packet]:
        """Everything in the inbox, oldest first, without waiting."""
        return [_packet(sample) for sample in self._inbox.drain()]

    def declare(self, stage: str) -> None:
        """Tell everyone that this process has reached `stage`; again has no effect."""
        if stage not in self._declared:
            key = f"{self.team}/{self.name}/{stage}/{self._me}"
            self._declared[stage] = self._session.liveliness().declare_token(key)

    @property
    def reached(self) -> frozenset[str]:
        """The stages that this process has declared."""
        return frozenset(self._declared)

    def members_at(self, stage: str) -> frozenset[str]:
        """Names of the other processes that are at `stage` now."""
        return frozenset(name for name, at, _ in self._tokens.copy() if at == stage)

    def duplicates(self, stage: str) -> frozenset[str]:
        """Names that two processes of the team carry at `stage`, this one's included."""
        names = [name for name, at, _ in self._tokens.copy() if at == stage]
        counts = Counter([*names, self.name] if stage in self._declared else names)
        return frozenset(name for name, count in counts.items() if count > 1)

    def wait_for(
        self, stage: str, names: Collection[str], timeout: float, stopped: Callable[[], bool]
    ) -> bool:
        """Wait until all `names` are at `stage`; False if the time is over, or `stopped()`."""
        deadline = monotonic() + timeout
        while frozenset(names) - {self.name} - self.members_at(stage):
            if stopped() or monotonic() > deadline:
                return False
            pause()
        return True

    def close(self) -> None:
        """Leave the network once the others have received what this process published.

        Zenoh takes ten seconds to close a session from which a frozen process has yet to read, and
        then fails. Such a session hears nothing any more, and ends with the process: it closes one
        that nobody refers to, even when the interpreter ends, so a reference is left for good.
        """
        if self._closed:
            return
        self._closed = True
        while self._declared:
            self._declared.popitem()[1].undeclare()  # type: ignore[no-untyped-call]
        if self._flush():
            self._session.close()  # type: ignore[no-untyped-call]
        else:
            for declared in self._declarations:
                declared.undeclare()
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._session))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _flush(self) -> bool:
        """Wait until all others have received what was published so far; whether they have.

        Zenoh's close drops what a busy receiver or router has not yet taken. A query travels
        behind the publications on each link, so its answers say that they have arrived.
        """
        asked = self._session.get(
            f"{self.team}/*/{RECEIVED}",
            target=zenoh.QueryTarget.ALL,
            timeout=_ACK_TIMEOUT,
            consolidation=zenoh.ConsolidationMode.NONE,
            express=True,
        )
        return all(reply.ok is not None for reply in asked)

    def _hear(self, key: str, handler: Any) -> Any:
        heard = self._session.declare_subscriber(key, handler, allowed_origin=zenoh.Locality.REMOTE)
        self._declarations.append(heard)
        return heard

    def _note_token(self, sample: zenoh.Sample) -> None:
        """A token has been declared, or has vanished; called by the thread that receives it."""
        _, name, stage, session = str(sample.key_expr).split("/")
        if session == self._me:
            return
        there = sample.kind == zenoh.SampleKind.PUT
        (self._tokens.add if there else self._tokens.discard)((name, stage, session))


def _packet(sample: zenoh.Sample) -> Packet:
    return str(sample.key_expr), sample.payload.to_bytes()


def _direct(call: Callable[[Any], object]) -> Any:
    """A Zenoh callback in the receiving thread, without a thread of its own in between."""
    return zenoh.handlers.Callback(call, indirect=False)


def _open(settings: dict[str, Any], name: str) -> zenoh.Session:
    """Open a session; that of a member receives in one thread unless the user has set `_THREADS`.

    Processes that this one starts, a router perhaps, do not inherit that.
    """
    config, at, chosen = zenoh.Config(), "", name == ROUTER or _THREADS in os.environ
    try:
        for at, value in settings.items():
            config.insert_json5(at, json.dumps(value))
        if not chosen:
            os.environ[_THREADS] = _ONE_RECEIVES
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise opening_error(settings, at, name, str(error)) from None
    finally:
        if not chosen:
            os.environ.pop(_THREADS, None)
