#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails when a function marked ROWE_RT has no exercise in tests/rt_contract, or an exercise names none.

    completeness.py PROGRAM PAGE FOLDER...    PROGRAM --functions prints one name for each exercise; the
                                              headers are all *.hpp and *.h below the folders. Where a
                                              function has several overloads, as many exercises must carry
                                              its name.
    completeness.py --self-test

It fails as well when PAGE, the documentation, does not name a class that has such functions (or the function
itself, where it has no class) in `code`. C is named by its header; namespace detail, which users do not see,
is what the others consist of.

A function's name is qualified by its classes and namespaces, without rowe:: and rt::, for example
histogram::record. It is found by reading the tokens of a header: enough of C++ to know which braces belong
to namespaces and classes, and that a declaration's name stands before its first parenthesis.
"""
import collections
import pathlib
import re
import subprocess
import sys

MARK = "ROWE_RT"
TOKEN = re.compile(r"[A-Za-z_]\w*|->\*|<=>|->|::|==|!=|<=|\+=|-=|\+\+|--|&&|\|\||\d[\w.']*|\S")


def tokens_of(text):
    """The tokens of a header without comments, literals and preprocessor lines."""
    text = re.sub(r'R"(\w*)\(.*?\)\1"', '""', text, flags=re.S)
    pattern = r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+'"
    text = re.sub(pattern, lambda m: '""' if m.group().startswith('"') else " ", text, flags=re.S)
    text = re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", "", text, flags=re.M)
    return TOKEN.findall(text)


def closing(tokens, at, opening, end):
    """The place behind the bracket that closes the one at `at`."""
    depth = 0
    while at < len(tokens):
        depth += (tokens[at] == opening) - (tokens[at] == end)
        at += 1
        if depth == 0:
            return at
    raise ValueError(f"unbalanced {opening}")


def class_name(tokens, at):
    """For `class`, `struct` or `union` at `at`: its name when a body follows, and where its brace stands."""
    name = None
    while at + 1 < len(tokens):
        at += 1
        token = tokens[at]
        if token == "{":
            return name or "", at
        if token in (";", "=", "(", ")", ">", ",") and name is not None:
            return None, at
        if token == "[":
            at = closing(tokens, at, "[", "]") - 1
        elif token == "alignas":
            at = closing(tokens, at + 1, "(", ")") - 1
        elif token == "<":
            at = closing(tokens, at, "<", ">") - 1
        elif token == ":":  # the bases
            while tokens[at] != "{":
                at += 1
            return name, at
        elif name is None and re.match(r"\w", token):
            name = token
    return None, at


def function_name(tokens, at):
    """The name that the declaration behind the mark at `at` declares."""
    at += 1
    while at < len(tokens):
        token = tokens[at]
        if token == "operator":
            end = at + 1
            while tokens[end] != "(" or end == at + 1 and tokens[end + 1] == ")":
                end += 1 if tokens[end] != "(" else 2
            parts = tokens[at + 1 : end]
            joined = "".join(parts)
            return "operator" + (" " + joined if re.match(r"\w", joined) else joined)
        if token == "[":
            at = closing(tokens, at, "[", "]")
        elif token == "<":
            at = closing(tokens, at, "<", ">")
        elif token in ("decltype", "alignas", "requires", "noexcept", "explicit") and tokens[at + 1] == "(":
            at = closing(tokens, at + 1, "(", ")")
        elif token == "(" and tokens[at + 2 : at + 4] == [")", "("]:  # hidden from macros
            return tokens[at + 1]
        elif token == "(":
            return ("~" if tokens[at - 2] == "~" else "") + tokens[at - 1]
        elif token in (";", "{", "}"):
            raise ValueError("no function behind " + MARK)
        else:
            at += 1
    raise ValueError("no function behind " + MARK)


def marked_functions(text):
    """The qualified names of all functions that a header marks, overloads repeated."""
    tokens = tokens_of(text)
    scopes = []  # the name that each open brace adds, or None
    found = []
    at = 0
    while at < len(tokens):
        token = tokens[at]
        if token == "template" and tokens[at + 1] == "<":
            at = closing(tokens, at + 1, "<", ">")
            continue
        if token == "namespace":
            end = at + 1
            while tokens[end] not in ("{", ";", "="):
                end += 1
            if tokens[end] == "{":
                scopes.append("".join(t for t in tokens[at + 1 : end] if t != "inline"))
            at = end + 1
            continue
        if token in ("class", "struct", "union") and tokens[at - 1] != "enum":
            name, end = class_name(tokens, at)
            if name is not None:
                scopes.append(name)
            at = end + 1
            continue
        if token == "{":
            scopes.append(None)
        elif token == "}":
            scopes.pop()
        elif token == MARK:
            path = "::".join(s for s in scopes if s).split("::")
            path = [p for p in path if p not in ("", "rowe", "rt")]
            found.append("::".join(path + [function_name(tokens, at)]))
        at += 1
    return found


def compare(declared, exercised):
    """Sentences about what does not agree."""
    faults = []
    for name, overloads in sorted(declared.items()):
        count = exercised.get(name, 0)
        if count == 0:
            faults.append(f"{name} is marked {MARK} and has no exercise")
        elif count < overloads:
            faults.append(f"{name} has {overloads} overloads marked {MARK} and only {count} exercises")
    unknown = sorted(name for name in exercised if name not in declared)
    faults += [f"{name} is exercised, but no header marks it" for name in unknown]
    return faults


def subject(name):
    """What the page has to name for a function; None: nothing."""
    if name.startswith("rowe_"):
        return "rowe/loop.h"
    if name.startswith("detail::"):
        return None
    scope = name.split("::operator")[0] if "::operator" in name else name.rpartition("::")[0]
    return scope or name


def unnamed(declared, page):
    """Sentences about what the page lacks."""
    named = {word for code in re.findall(r"`([^`\n]+)`", page) for word in re.split(r"[^\w/.]+", code)}
    wanted = {subject(name) for name in declared} - {None}
    return [f"{name} has functions marked {MARK}, and the documentation does not name it"
            for name in sorted(wanted) if name.rpartition("::")[2] not in named]


SAMPLE = r'''
#define ROWE_RT
// ROWE_RT void in_a_comment();
namespace rowe::rt {
enum class kind : int { a, b };
template <class T, class Atomics = std_atomics>
class alignas(64) ring final : public base<T> {
 public:
  const char* text() { return "ROWE_RT void in_a_string() {"; }
  class producer {
    [[nodiscard]] ROWE_RT bool try_push(const T& item) noexcept { if (a < b) { return '{'; } return true; }
    ROWE_RT std::optional<std::pair<int, T>> peek() const;
  };
  template <class Take> ROWE_RT std::size_t drain(Take&& take) noexcept;
  ROWE_RT explicit operator bool() const noexcept;
  ROWE_RT operator std::string_view() const;
  ROWE_RT T& operator*() &;
  ROWE_RT const T& operator*() const&;
  ROWE_RT T* operator->();
  ROWE_RT T operator()(int) const;
  ROWE_RT friend bool operator==(const ring&, const ring&);
  ROWE_RT ~ring();
  ROWE_RT T (max)() const noexcept;
  ROWE_RT explicit(true) ring(ring&&) noexcept(noexcept(T{}));
  struct entry* next_;
};
template <> class ring<void> { ROWE_RT bool has_value() const; };
ROWE_RT constexpr auto free_one(time_point now) noexcept -> int { return 1'000; }
}
namespace rowe { namespace detail { struct queue_pair { ROWE_RT decltype(auto) get() const; }; } }
'''


def self_test():
    expected = ["ring::producer::try_push", "ring::producer::peek", "ring::drain", "ring::operator bool",
                "ring::operator std::string_view", "ring::operator*", "ring::operator*", "ring::operator->",
                "ring::operator()", "ring::operator==", "ring::~ring", "ring::max", "ring::ring",
                "ring::has_value", "free_one", "detail::queue_pair::get"]
    found = marked_functions(SAMPLE)
    assert found == expected, f"\nfound    {found}\nexpected {expected}"
    declared = collections.Counter(found)
    assert compare(declared, declared) == []
    without = declared.copy()
    del without["free_one"]
    without["ring::operator*"] = 1
    without["gone"] = 1
    assert compare(declared, without) == [
        "free_one is marked ROWE_RT and has no exercise",
        "ring::operator* has 2 overloads marked ROWE_RT and only 1 exercises",
        "gone is exercised, but no header marks it"], compare(declared, without)
    page = "The `ring` (its `ring::producer`: `try_push`); free_one; `rowe/loop.h`."
    faults = unnamed(list(declared) + ["rowe_now_ns"], page)
    assert faults == ["free_one has functions marked ROWE_RT, and the documentation does not name it"], faults
    assert unnamed(declared, page + " `free_one`") == []


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    program, page, *folders = sys.argv[1:]
    declared = collections.Counter()
    for folder in folders:
        for header in sorted(p for p in pathlib.Path(folder).rglob("*") if p.suffix in (".hpp", ".h")):
            try:
                declared.update(marked_functions(header.read_text(encoding="utf-8")))
            except (ValueError, IndexError) as fault:
                raise SystemExit(f"{header}: {fault}") from fault
    listed = subprocess.run([program, "--functions"], check=True, capture_output=True, text=True).stdout
    faults = compare(declared, collections.Counter(listed.split("\n")[:-1]))
    faults += unnamed(declared, pathlib.Path(page).read_text(encoding="utf-8"))
    for fault in faults:
        print(fault)
    print(f"{len(declared)} functions marked {MARK}, {sum(declared.values())} with their overloads")
    return 1 if faults or not declared else 0


if __name__ == "__main__":
    sys.exit(main())
