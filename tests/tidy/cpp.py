# SPDX-License-Identifier: Apache-2.0
"""As much of C++ as it takes to follow calls through src/service: which functions a file defines, and whom
their bodies call, by the member that holds the other part, or by a member of that. No compiler: it relies on
the style of the tree (members end in `_`, one class a file, which its .cpp defines)."""
import functools
import os
import re

_words = {"if", "for", "while", "switch", "return", "sizeof", "catch", "static_assert", "noexcept", "alignas",
          "decltype", "static_cast", "reinterpret_cast", "const_cast", "defined", "assert"}
_call = re.compile(r"(?:(\w+_)((?:(?:\.|->)\w+(?:\(\))?)*)(?:\.|->)|(\w+)::|((?:\.|->)\s*)|\b)(\w+)\s*"
                   r"(?:<[\w:]+>)?\(")
_member = re.compile(r"(?m)^\s+(?:const |class )?(?:\w+::)*(\w+)(?:<>)?&? (\w+)(?:;| =|\{)")
_accessor = re.compile(r"(\w+)& (\w+)\(\) (?:const )?noexcept")
_after_signature = re.compile(r"\s*(const\b\s*)?(noexcept\b\s*)?(override\b\s*|final\b\s*)*"
                              r"(?:(=\s*0\s*;)|(:[^;{]*(?:\{[^{}]*\}[^;{]*)*?)?(\{))")


def close(text, at, pair):
    """Behind the bracket that closes the one at `at`."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] == pair[0]) - (text[i] == pair[1])
        if depth == 0:
            return i + 1
    return len(text)


class unit:
    """NAME.hpp and NAME.cpp of one folder, and the class in them."""

    def __init__(self, t, stem):
        self.files = [stem + suffix for suffix in (".hpp", ".cpp", ".h") if t.exists(stem + suffix)]
        self.text = {path: "\n".join(t.code(path)) for path in self.files}
        header = self.text.get(stem + ".hpp", "")
        found = re.findall(r"(?m)^(?:class|struct) (\w+)(?: final)?(?: : ([^{;]*))? \{", header)
        self.bases = {name: re.findall(r"\w+(?=\s*(?:,|$))", bases) for name, bases in found}
        self.classes = list(self.bases)
        own = os.path.basename(stem)
        self.name = own if own in self.classes else "".join(self.classes[:1])
        self.members = {name: kind for kind, name in _member.findall(header)}
        self.accessors = {name: kind for kind, name in _accessor.findall(header)}

    @functools.lru_cache(maxsize=None)
    def bodies(self, name, path=None):
        """What the functions of this name do; "" of one that others are to define."""
        found = []
        for one in [path] if path else self.files:
            text = self.text.get(one, "")
            for match in re.finditer(rf"(?<![\w.>]){name}\s*\(", text):
                before = text[:match.start()]
                qualified = re.search(r"(\w+)::$", before)
                if qualified and qualified[1] not in self.classes:
                    continue
                if not qualified and not re.search(r"[\w>&*]\s$", before):
                    continue
                end = close(text, match.end() - 1, "()")
                rest = _after_signature.match(text, end)
                if rest and rest[6]:
                    at = rest.end() - 1
                    found.append(text[at:close(text, at, "{}")])
                elif rest:
                    found.append("")
        return found


class program:
    def __init__(self, t):
        self.t = t
        self.units = {}
        self.home = {}
        for path in t.within(["src"], (".hpp",)):
            for name in self.unit(path).classes:
                self.home.setdefault(name, self.unit(path))

    def unit(self, path):
        stem = os.path.splitext(path)[0]
        if stem not in self.units:
            self.units[stem] = unit(self.t, stem)
        return self.units[stem]

    def kin(self, name):
        """A class and what it is made of."""
        yield name
        for base in self.home[name].bases[name] if name in self.home else ():
            yield from self.kin(base)

    def member(self, of, name):
        for one in of.classes:
            for kind in self.kin(one):
                if kind in self.home and name in self.home[kind].members:
                    return self.home[kind].members[name]
        return None

    def calls(self, of, name, under=()):
        """(class, function) of each call that a function makes, in the order of the text; calls within its
        class are followed."""
        if name in under:
            return
        for body in of.bodies(name):
            for member, within, scope, other, called in _call.findall(body):
                if called in _words or other:
                    continue
                if member:
                    kind = self.member(of, member)
                    for step in re.findall(r"\w+(?:\(\))?", within):
                        held = self.home[kind] if kind in self.home else None
                        found = held and (held.accessors.get(step[:-2]) if step.endswith(")") else
                                          held.members.get(step))
                        kind = found or None
                    if kind:
                        yield kind, called
                elif scope and scope not in of.classes:
                    yield scope, called
                elif of.bodies(called):
                    yield of.name, called
                    yield from self.calls(of, called, (*under, name))

    def is_of(self, kind, path):
        """Whether a call by a member of type `kind` may end in that file."""
        return any(kind in self.kin(one) for one in self.unit(path).classes)
