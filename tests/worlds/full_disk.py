"""A disk that takes no more, by the limit that the system sets on the size of files.

Owns the limit of this process. A write beyond it fails, as on a disk that is full.
"""

import resource
import signal
from contextlib import contextmanager


@contextmanager
def files_end_at(size):
    """No file grows beyond so many bytes within the block."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # Without this the signal of the limit would end the process; Python ignores it, too.
    handled = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handled)


def largest(folder):
    """Size of the largest file of a folder, bytes."""
    return max(file.stat().st_size for file in folder.iterdir())
