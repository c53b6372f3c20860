"""Memory that is free goes back to the system, so that a worker does not grow while it works."""

import ctypes
import sys


def give_back_memory() -> None:
    """Let the C library return what is free.

    Arrays of a megabyte come and go between small ones that stay; glibc keeps what lies between them, up to several
    hundred megabytes.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # of glibc; musl has none and needs none
        if trim is not None:
            trim(0)
