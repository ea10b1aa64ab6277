"""A stop is a flag, and no process outlives its parent."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.signals import interruptible, interrupts_held, stop_flag

CHILD = """
import os, signal, sys
from quadriga.shared.runtime.signals import die_with_parent, kill_if_orphaned
if sys.argv[2:] == ["deaf"]:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    kill_if_orphaned(int(sys.argv[1]), 0.2)
die_with_parent(int(sys.argv[1]))
print(os.getpid(), flush=True)
while True:
    pass
"""
PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, "-c", sys.argv[1], str(os.getpid()), *sys.argv[2:]])
input()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_ends_at_once_what_looks_at_no_flag(number: signal.Signals) -> None:
    def wait_after_it() -> None:
        os.kill(os.getpid(), number)
        sleep(60.0)

    before = signal.getsignal(number)
    with stop_flag() as stopped:
        with pytest.raises(KeyboardInterrupt), interruptible(stopped):
            wait_after_it()
        assert not stopped()
        os.kill(os.getpid(), number)
        assert stopped(), "and after it the flag is raised as before"
        with pytest.raises(KeyboardInterrupt), interruptible(stopped):
            pytest.fail("a stop that has come before the block")
    assert signal.getsignal(number) is before


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("words", [(), ("deaf",)], ids=["heeds", "heeds no signal"])
def test_kill_9_of_the_parent_ends_the_child(words: tuple[str, ...]) -> None:
    """One that does not heed the signal is killed some time later."""
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", PARENT, CHILD, *words]
    parent = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
    assert parent.stdout
    assert parent.stderr
    child = int(parent.stdout.readline())
    sleep(0.4)
    assert alive(child), "while its parent lives nobody kills it"
    parent.kill()
    said = parent.stderr.read()  # until the child has ended, too
    parent.communicate()
    killed = f"quadriga: killed 0.2 s after process {parent.pid}, which had started this one\n"
    assert said == (killed if words else "")
    deadline = monotonic() + 60.0
    while alive(child) and monotonic() < deadline:
        sleep(0.01)
    assert not alive(child)


def test_a_child_whose_parent_is_gone_already_ends_itself() -> None:
    orphan = subprocess.run([sys.executable, "-c", CHILD, "1"], capture_output=True, check=False)
    assert orphan.returncode == -signal.SIGTERM
    assert orphan.stdout == b""


@pytest.mark.parametrize("from_a_thread", [False, True])
def test_an_interrupt_comes_after_the_block(from_a_thread: bool) -> None:
    """Whichever thread the kernel gives it to."""
    done: list[bool] = []

    def interrupted_while_held() -> None:
        with interrupts_held():
            if from_a_thread:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
                thread = threading.Thread(target=signal.raise_signal, args=(signal.SIGINT,))
                thread.start()
                thread.join()
            else:
                signal.raise_signal(signal.SIGINT)
            done.append(True)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted_while_held()
        assert done == [True]
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


LIBRARY = """
import os, signal
try:
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(1000):
        pass
except BaseException as error:
    raise ImportError("half set up") from error
ready = True
"""
CALLS_BACK = """
import ctypes, os, signal

@ctypes.CFUNCTYPE(None)
def called():
    os.kill(os.getpid(), signal.SIGTERM)
    for _ in range(1000):
        pass

called()
"""
PROGRAM = """
import os, sys
folder, how = sys.argv[1:]
sys.path.insert(0, folder)
from quadriga.commands import config

def run(*_):
    if how == "import":
        import library
        assert library.ready
    else:
        exec(open(folder + "/library.py").read(), {})
    os.write(1, b"gone on\\n")  # at once, or not at all
    while True:
        pass

config.run = run
from quadriga.commands import parser
sys.argv = ["quadriga", "config"]
from quadriga.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize(
    ("library", "how"), [(LIBRARY, "import"), (CALLS_BACK, "run")], ids=["import", "callback"]
)
def test_an_interrupt_at_a_bad_moment_is_one_line(tmp_path: Path, library: str, how: str) -> None:
    """As a library in C does, this one makes an error of its own of it, or Python loses it."""
    (tmp_path / "library.py").write_text(library, encoding="utf-8")
    command = [sys.executable, "-c", PROGRAM, str(tmp_path), how]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert (done.returncode, done.stderr) == (130, "quadriga: interrupted\n")
    assert done.stdout == "gone on\n"
