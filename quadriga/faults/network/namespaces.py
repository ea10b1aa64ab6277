"""SHELL of network namespaces, devices on the air and cables, as Linux has them.

A namespace made here has no name: an open file is all that holds it, besides the processes in it.
So nothing of it is left once those are gone, however they went.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from quadriga.shared.errors import ProcessError, system_reason

_OWN: Final = "/proc/thread-self/ns/net"
_CLONE_NEWNET: Final = 0x40000000  # linux/sched.h
_TUN: Final = "/dev/net/tun"
_TUNSETIFF: Final = 0x400454CA  # linux/if_tun.h, as the next two
_IFF_TUN, _IFF_NO_PI = 0x0001, 0x1000
_QUEUE: Final = 2000  # packets that wait for the air, before the kernel drops some
_NEEDED: Final = "the rights of root: CAP_SYS_ADMIN and CAP_NET_ADMIN"


def make_namespace() -> int:
    """A new network namespace with a loopback, as an open file that holds it.

    Raises:
        ProcessError: the system does not permit it.
    """
    home = os.open(_OWN, os.O_RDONLY | os.O_CLOEXEC)
    try:
        _check(_libc().unshare(_CLONE_NEWNET), "unshare")
        made = os.open(_OWN, os.O_RDONLY | os.O_CLOEXEC)
        run_ip("link", "set", "lo", "up")
    finally:
        _check(_libc().setns(home, _CLONE_NEWNET), "setns")
        os.close(home)
    return made


@contextmanager
def inside(namespace: int | None) -> Iterator[None]:
    """Have this thread, and what it starts, be in a namespace; None: in the machine's own.

    Raises:
        ProcessError: the system does not permit it.
    """
    if namespace is None:
        yield
        return
    home = os.open(_OWN, os.O_RDONLY | os.O_CLOEXEC)
    try:
        _check(_libc().setns(namespace, _CLONE_NEWNET), "setns")
        yield
    finally:
        _check(_libc().setns(home, _CLONE_NEWNET), "setns")
        os.close(home)


def open_tun(device: str) -> int:
    """A device whose packets are read and written at an open file, without waiting.

    It is in the namespace of this thread, and gone once the file is closed.

    Raises:
        ProcessError: the system has none, or does not permit it.
    """
    try:
        tun = os.open(_TUN, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        flags = struct.pack("16sH22x", device.encode(), _IFF_TUN | _IFF_NO_PI)
        fcntl.ioctl(tun, _TUNSETIFF, flags)
    except OSError as error:
        raise ProcessError(_TUN, system_reason(error), _NEEDED, "or the module tun") from None
    run_ip("link", "set", device, "txqueuelen", str(_QUEUE))
    return tun


def run_ip(*words: str) -> None:
    """Configure the namespace of this thread.

    Raises:
        ProcessError: `ip` is not there, or refuses.
    """
    command = f"ip {' '.join(words)}"
    try:
        done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    except OSError as error:
        raise ProcessError(command, system_reason(error), "the package iproute2") from None
    if done.returncode:
        raise ProcessError(command, done.stderr.strip() or f"status {done.returncode}", _NEEDED)


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _check(result: int, call: str) -> None:
    if result:
        reason = os.strerror(ctypes.get_errno())
        raise ProcessError(f"network namespaces ({call})", reason, _NEEDED)
