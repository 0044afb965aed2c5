# SPDX-License-Identifier: Apache-2.0
"""Reads a QR code with zbar: rows of 0 and 1 (a dark module) on stdin, its text on stdout."""
import sys

import zbar

scale = 4  # pixels a module
rows = sys.stdin.read().split()
pixels = b"".join(bytes(0 if module == "1" else 255 for module in row for _ in range(scale)) * scale
                  for row in rows)
image = zbar.Image(len(rows[0]) * scale, len(rows) * scale, "Y800", pixels)
zbar.ImageScanner().scan(image)
for symbol in image:
    print(symbol.data)
