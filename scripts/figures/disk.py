"""How fast the disk reads and writes by itself."""

import os
import time

CHUNK = 1 << 20
CHUNKS = 1024


def bandwidth(folder):
    """Bytes a second that a file in `folder` is read and written with, past the page cache."""
    path = folder / f"bandwidth-{os.getpid()}"
    # What does not compress.
    chunk = os.urandom(CHUNK)
    try:
        with open(path, "wb", buffering=0) as file:
            begin = time.monotonic()
            for _ in range(CHUNKS):
                file.write(chunk)
            os.fsync(file.fileno())
            writing = time.monotonic() - begin
        with open(path, "rb", buffering=0) as file:
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
            begin = time.monotonic()
            while file.read(CHUNK):
                pass
            reading = time.monotonic() - begin
    finally:
        path.unlink(missing_ok=True)
    size = CHUNK * CHUNKS
    return size / reading, size / writing
