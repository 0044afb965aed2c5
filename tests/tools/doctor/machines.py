# SPDX-License-Identifier: Apache-2.0
"""Machines as files: unpacks one of this folder, with changes, for `rowe doctor --root`."""
import os
import shutil
import tempfile

here = os.path.dirname(os.path.abspath(__file__))


def entries(name):
    """{path: text} of a machine; a text of None is a folder, a tuple holds a link's target."""
    found, path, lines = {}, None, []

    def keep():
        if path is not None:
            found[path] = "".join(line + "\n" for line in lines)

    with open(os.path.join(here, name + ".txt"), encoding="utf-8") as file:
        for line in file.read().splitlines():
            if not line.startswith("@ "):
                lines.append(line)
                continue
            keep()
            path, lines = line[2:], []
            if " -> " in path:
                link, target = path.split(" -> ")
                found[link], path = (target,), None
            elif path.endswith("/"):
                found[path], path = None, None
    keep()
    return found


class machine:
    """A folder with a machine's files, until the end of the `with`.

    `changes` maps paths to a new text; to None for what is missing, be it a file or a folder. `trials` maps
    the beginnings of lines of /trials to the line that takes their place; None takes it away.
    """

    def __init__(self, name, changes=None, trials=None):
        self.files = entries(name)
        for path, text in (changes or {}).items():
            if text is None:
                gone = [one for one in self.files if one == path or one.startswith(path.rstrip("/") + "/")]
                assert gone, f"{name} has no {path} to take away"
                for one in gone:
                    del self.files[one]
            else:
                self.files[path] = text
        for begin, line in (trials or {}).items():
            lines = self.files["/trials"].splitlines()
            kept = [one for one in lines if not one.startswith(begin + " ")]
            assert line is not None or len(kept) < len(lines), f"{name} has no trial {begin} to take away"
            self.files["/trials"] = "\n".join(kept + ([line] if line else [])) + "\n"

    def __enter__(self):
        self.root = tempfile.mkdtemp(prefix="rowe-doctor-")
        for path, text in self.files.items():
            full = self.root + path
            if text is None:
                os.makedirs(full, exist_ok=True)
                continue
            os.makedirs(os.path.dirname(full), exist_ok=True)
            if isinstance(text, tuple):
                os.symlink(text[0], full)
            else:
                with open(full, "w", encoding="utf-8") as file:
                    file.write(text)
        return self.root

    def __exit__(self, *_):
        shutil.rmtree(self.root)
