"""What the last bits of a sum depend on, besides the code: machine, libraries and threads.

OpenBLAS, numpy and the C library each choose their kernels by the processor they find. These add
and multiply in another order, or fuse the two, and so differ in the last bits. With the golden
walk, as the largest deviation of a field relative to its largest magnitude: OpenBLAS's Haswell
instead of SkylakeX kernels 4e-12, its Nehalem kernels 2e-8, numpy without AVX-512 5e-13, the C
library without fused multiply-add 2e-12. The processor that numba compiles for made none: without
`fastmath` it may neither reorder nor fuse.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
import platform
import struct
from functools import lru_cache
from pathlib import Path
from typing import Final

import numba
import numpy as np
import scipy.linalg  # noqa: F401  (loads the BLAS that is asked about)
from threadpoolctl import threadpool_info, threadpool_limits

_PACKAGES: Final = ("numpy", "scipy", "numba", "llvmlite", "pin", "libpinocchio", "daqp")


def arithmetic() -> dict[str, str]:
    """Names of everything here that decides on the last bits. Equal maps: equal bytes."""
    cores = sorted(
        f"{info['version']} {info['architecture']}"
        for info in threadpool_info()
        if info["user_api"] == "blas"
    )
    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "machine": platform.machine(),
        "libc": f"{' '.join(platform.libc_ver())} {_libm()}",
        "python": ".".join(platform.python_version_tuple()[:2]),
        "BLAS": ", ".join(cores),
        "numpy's SIMD": " ".join(simd.get("found", [])) or "baseline",
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
    }


@lru_cache(maxsize=1)
def arithmetic_digest() -> str:
    """Digest of what decides on the last bits here: equal digests, equal bytes."""
    text = json.dumps([arithmetic(), bool(numba.config.DISABLE_JIT)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def use_one_blas_thread() -> None:
    """Hold BLAS to one thread from now on.

    It sums in another order with another number of threads, so that the last bits of a plan would
    tell how many cores the machine has; and agents on one machine would fight for them.
    """
    threadpool_limits(limits=1)


def _libm() -> str:
    """Digest of some values: with one version of the library they depend on the processor."""
    values = [f(0.37 * k) for k in range(1, 200) for f in (math.sin, math.cos, math.exp, math.atan)]
    return hashlib.sha256(struct.pack(f"<{len(values)}d", *values)).hexdigest()[:8]


def processor() -> str:
    """What this machine's processor is called, for a reader: it decides on no bit."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((x.partition(":")[2].strip() for x in lines if x.startswith("model name")), "?")
