"""A branch sees all that the process holds, changes none of it, and never outlives its call."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from quadriga.experiments.probe.branch import run_branch
from quadriga.shared.errors import ProcessError

# Python 3.12 warns wherever a library has threads of its own, BLAS for one.
pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")


def test_a_branch_goes_on_from_here_and_leaves_no_trace() -> None:
    random, seen = np.random.default_rng(3), [1, 2]

    def go_on() -> bytes:
        seen.append(3)
        return random.standard_normal(5).tobytes() + bytes(seen)

    first, second = run_branch(go_on), run_branch(go_on)
    assert first == second
    assert seen == [1, 2]
    assert go_on() == first


def test_an_answer_may_be_longer_than_a_pipe_holds() -> None:
    assert run_branch(lambda: bytes(3_000_000)) == bytes(3_000_000)


def test_what_a_branch_raises_is_named() -> None:
    def fail() -> bytes:
        raise ValueError("no such robot")

    with pytest.raises(ProcessError, match="ValueError: no such robot"):
        run_branch(fail)


def test_a_branch_that_is_killed_is_an_error() -> None:
    def die() -> bytes:
        os.kill(os.getpid(), signal.SIGKILL)
        return b"too late"

    with pytest.raises(ProcessError, match="its death"):
        run_branch(die)


def test_no_branch_is_left_behind() -> None:
    branch = int(run_branch(lambda: str(os.getpid()).encode()))
    assert branch != os.getpid()
    with pytest.raises(ChildProcessError):
        os.waitpid(branch, os.WNOHANG)
