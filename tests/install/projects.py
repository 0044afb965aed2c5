# SPDX-License-Identifier: Apache-2.0
"""Bare projects, copied to a folder outside the tree, so that only what is installed, or asked for, can be
found. Every command has an end (`timeout`)."""
import os
import pathlib
import shutil
import subprocess

source = pathlib.Path(os.environ["ROWE_SOURCE"])
build = pathlib.Path(os.environ["ROWE_BUILD"])
cmake = os.environ["ROWE_CMAKE"]
version = os.environ["ROWE_VERSION"]
libraries = os.environ["ROWE_LIBDIR"]  # below a prefix
compilers = {"C": os.environ["ROWE_CC"], "CXX": os.environ["ROWE_CXX"]}
timeout = 250  # seconds; far above what anything here takes

# What a user's environment could add to a build is not these tests' affair.
swayed_by = ("CFLAGS", "CXXFLAGS", "LDFLAGS", "CPATH", "LIBRARY_PATH", "DESTDIR", "PKG_CONFIG_PATH",
             "PKG_CONFIG_LIBDIR")
environment = {name: value for name, value in os.environ.items()
               if name not in swayed_by and not name.startswith("CMAKE_")}


def run(*command, **more):
    """Its exit code and its lines, of both streams."""
    ended = subprocess.run([str(one) for one in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                           encoding="utf-8", timeout=timeout, check=False,
                           env={**environment, **{name: str(value) for name, value in more.items()}})
    return ended.returncode, ended.stdout


def done(*command, **more):
    """The lines of a command that must succeed."""
    code, said = run(*command, **more)
    assert code == 0, f"{' '.join(map(str, command))} ended with {code}:\n{said}"
    return said


def copied(folder):
    """The projects, where the tree is not above them."""
    return pathlib.Path(shutil.copytree(source / "tests" / "install", folder,
                                        ignore=shutil.ignore_patterns("*.py", "__pycache__")))


class project:
    """In `folder`, built in `folder`/build."""

    def __init__(self, folder, languages, *options, **more):
        self.folder, self.built, self.more = folder, folder / "build", more
        self.command = (cmake, "-G", os.environ["ROWE_GENERATOR"], "-S", folder, "-B", self.built,
                        *(f"-DCMAKE_{one}_COMPILER={compilers[one]}" for one in languages), *options)

    def configure(self):
        return done(*self.command, **self.more)

    def diagnostic(self):
        """Why it cannot be configured, as one line; None where it can."""
        code, said = run(*self.command, **self.more)
        return " ".join(said.split()) if code != 0 else None

    def make(self, target):
        """The lines of the build, with every command of it."""
        return done(cmake, "--build", self.built, "--target", target, "--verbose", **self.more)
