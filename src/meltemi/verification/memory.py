"""Memory of the process."""

from __future__ import annotations

import sys


def peak_memory() -> float:
    """[bytes] peak resident memory of the process."""
    try:
        import resource
    except ImportError:  # Windows
        import psutil

        return float(psutil.Process().memory_info().peak_wset)
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(kilobytes if sys.platform == "darwin" else 1024 * kilobytes)
