"""Trials on the workers of a Dask scheduler, which may be other machines that come and go."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any, Final

import dask
import distributed
from distributed import Client, LocalCluster, WorkerPlugin

from quadriga.experiments.campaign.job import TrialJob, walk_trial
from quadriga.experiments.predictors import file_sha256
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.shared.errors import ConfigError, ProcessError
from quadriga.shared.runtime.atomic import write_bytes
from quadriga.shared.runtime.places import cache_dir
from quadriga.shared.runtime.signals import interrupts_held
from quadriga.workers import SAFE_PATH

LOCAL: Final = "local"  # the address of a cluster that is made here and goes with the campaign
_CONNECT: Final = 15.0  # s
_ARRIVE: Final = 120.0  # s, until the first worker must be there
_ONE_WALK: Final = Lock()  # of this process: planners keep memory of their own


class FileShipment(WorkerPlugin):
    """Brings files to every worker, also to one that joins later: they are named by content."""

    def __init__(self, files: Iterable[Path]) -> None:
        self._files = {f"{file_sha256(path)}{path.suffix}": path.read_bytes() for path in files}
        # A plugin takes the place of one of the same name: two campaigns have their own.
        self.name = f"quadriga-{sha256(''.join(sorted(self._files)).encode()).hexdigest()[:16]}"

    def setup(self, worker: Any) -> None:
        """Write the files where `_here` looks for them; `worker` is given by Dask."""
        folder = _folder()
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self._files.items():
            write_bytes(folder / name, content)


def run_each(
    todo: Sequence[TrialJob], jobs: int, address: str
) -> Generator[tuple[TrialJob, TrialOutcome], None, None]:
    """Jobs with their outcomes, in the order in which they are done, each once.

    A job whose worker dies is given to another one.

    Args:
        todo: what to walk.
        jobs: workers of a cluster that is made here.
        address: of a scheduler, or `LOCAL`.

    Raises:
        ConfigError: nobody answers there.
        ProcessError: no worker comes, the scheduler leaves, or workers die of a job again and
            again.
    """
    with ExitStack() as stack:
        client = _client(stack, jobs, address)
        paths = dict.fromkeys(path for job in todo for path in job.fitted.files)
        names = {path: f"{file_sha256(path)}{path.suffix}" for path in paths}
        client.register_plugin(FileShipment(paths))
        futures = {}
        for job in todo:
            fitted = job.fitted
            there = replace(
                fitted,
                path=fitted.path and Path(names[fitted.path]),
                data=fitted.data and Path(names[fitted.data]),
            )
            # Not pure: equal jobs of two campaigns are two, whatever the scheduler remembers.
            future = client.submit(walk_on_worker, replace(job, fitted=there), pure=False)
            futures[future] = job
        try:
            for future in distributed.as_completed(list(futures)):
                job = futures.pop(future)
                try:
                    row = future.result()
                except distributed.KilledWorker as error:
                    raise ProcessError(
                        job.name, f"workers that died of it: {error}", "an outcome"
                    ) from None
                yield job, row
        except distributed.CancelledError:
            raise ProcessError(
                "the Dask scheduler",
                "its end",
                "outcomes",
                "the same command goes on where it ended",
            ) from None
        finally:
            if futures:
                client.cancel(list(futures))


def walk_on_worker(job: TrialJob) -> TrialOutcome:
    """Walk a job on a worker of Dask, which may have several threads: one walk at a time."""
    fitted = job.fitted
    here = replace(fitted, path=_here(fitted.path), data=_here(fitted.data))
    with _ONE_WALK:
        return walk_trial(replace(job, fitted=here))


def _client(stack: ExitStack, jobs: int, address: str) -> Client:
    if address == LOCAL:
        # No worker may import from the working directory; the user's programs that it starts may.
        safe = dask.config.set({f"distributed.nanny.pre-spawn-environ.{SAFE_PATH}": "1"})
        with interrupts_held(), safe:  # an interrupt is this process's to handle
            cluster = LocalCluster(
                n_workers=jobs,
                threads_per_worker=1,
                dashboard_address=None,
                silence_logs=50,
                env={SAFE_PATH: os.environ.get(SAFE_PATH, "")},
            )
        stack.callback(cluster.close)
        address = cluster.scheduler_address
    try:
        client: Client = stack.enter_context(Client(address, timeout=_CONNECT))
    except (OSError, ValueError) as error:
        raise ConfigError("--dask", address, "a scheduler that answers", str(error)) from None
    try:
        client.wait_for_workers(1, timeout=_ARRIVE)
    except distributed.TimeoutError:
        raise ProcessError(
            "the Dask scheduler",
            f"no worker in {_ARRIVE:g} s",
            "a worker",
            f"start some: dask worker {address} --nthreads 1",
        ) from None
    return client


def _folder() -> Path:
    return cache_dir() / "shipped"


def _here(name: Path | None) -> Path | None:
    return name and _folder() / name
