"""Imported before numpy it holds BLAS to one thread, as agents that share a machine must."""

from __future__ import annotations

import os
import sys

THREADS = 1

if "numpy" in sys.modules:
    raise ImportError("blas_threads must be imported before numpy")
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = str(THREADS)
