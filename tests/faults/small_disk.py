# SPDX-License-Identifier: Apache-2.0
"""A disk of its own for a test: small, in memory, and mounted where nobody else sees it."""
import os
import subprocess
import sys
import tempfile


def without_small_disk(size):
    """Starts the script again where a disk of so many bytes is mounted at $ROWE_SMALL_DISK, and ends with it.
    Returns "" there; elsewhere it returns why that cannot be."""
    if "ROWE_SMALL_DISK" in os.environ:
        return ""
    if subprocess.run(["unshare", "-rm", "true"], check=False, capture_output=True).returncode != 0:
        return "this machine makes no mount namespace for this user"
    with tempfile.TemporaryDirectory() as disk:
        mount = f'mount -t tmpfs -o size={size} none "$ROWE_SMALL_DISK" && exec "$0" "$@"'
        ended = subprocess.run(["unshare", "-rm", "sh", "-c", mount, sys.executable, *sys.argv], check=False,
                               env={**os.environ, "ROWE_SMALL_DISK": disk})
    sys.exit(ended.returncode)
