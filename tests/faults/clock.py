# SPDX-License-Identifier: Apache-2.0
"""A clock of the day that a test sets."""
import mmap
import os
import struct
import tempfile

# Empty under the sanitizers, which want nothing to be preloaded before them.
preloaded = os.environ.get("ROWE_FAULTS_CLOCK", "")


class clock:
    """That of the processes that get its environment, by clock.cpp."""

    def __init__(self, shift=0):
        self.file = tempfile.NamedTemporaryFile(prefix="rowe-clock-")
        self.file.write(bytes(8))
        self.file.flush()
        self.memory = mmap.mmap(self.file.fileno(), 8)
        self.environment = {"LD_PRELOAD": preloaded,
                            "ROWE_FAULTS_CLOCK_SHIFT": self.file.name}
        self.set(shift)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.memory.close()
        self.file.close()

    def set(self, shift):
        """Seconds from the right time."""
        self.memory[:] = struct.pack("q", shift)
