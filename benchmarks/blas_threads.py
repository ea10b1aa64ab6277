"""Limits BLAS to one thread if imported before numpy, as in agents that share a machine."""

from __future__ import annotations

import os
import sys

THREADS = 1

if "numpy" in sys.modules:
    raise ImportError("blas_threads must be imported before numpy")
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = str(THREADS)
