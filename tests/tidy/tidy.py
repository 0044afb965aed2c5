#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The rules of the house that no compiler knows, checked over the whole tree.

    tests/tidy/tidy.py [TREE]      prints `path:line: rule: what`, one a line; exit code 1 if there is any

A rule is a function that takes the tree and yields findings. Every exception stands in `exempt`, with its
reason; one that excuses nothing any more is a finding itself. tidy_test.py plants offences against each rule
in a copy of the tree and sees that they are found.
"""
import functools
import os
import re
import sys

import inside
from tree import code_suffixes, finding, strip, tree

columns_max = 110
library = ("src", "include", "rt")
product = (*library, "tools", "docs")

# (path, rule): why it may.
exempt = {
    ("include/rowe/result.hpp", "no-output-no-abort"): "without exceptions, value() can only end the program",
    ("rt/src/thread.cpp", "banned-word"): "each page of the stack is to be written, although nobody reads it",
    ("rt/tripwire/scope.cpp", "no-output-no-abort"): "stopping the program is what a tripwire is for",
    ("src/service/threads/shared_inbox.cpp", "core-is-a-function"): "the threads that sleep there read it",
    ("src/service/core/service_loop.cpp", "core-is-a-function"): "the loop reads the clock for the core",
    ("tests/capi/paper_listings.c", "white-space"): "the paper prints its listings with tabs",
    ("tests/rt/tripwire_test.cpp", "no-sleep-in-tests"): "the sleep is what the tripwire has to see",
}


@functools.lru_cache(maxsize=None)
def may_match(pattern, text):
    """False: no line of it does."""
    whole = re.compile(pattern, re.MULTILINE) if isinstance(pattern, str) else pattern
    return whole.search(text) is not None


def matches(t, paths, pattern, rule, what, raw=False):
    """A finding for each line with `pattern` in it; unless `raw`, C++ comments and strings do not count."""
    for path in paths:
        stripped = path.endswith(code_suffixes) and not raw
        if not may_match(pattern, strip(t.text(path)) if stripped else t.text(path)):
            continue
        lines = t.code(path) if stripped else t.lines(path)
        for number, line in enumerate(lines, 1):
            found = re.search(pattern, line)
            if found:
                yield finding(path, number, rule, what.format(found[0].strip()))


# ---- who may see what


def libraries_stay_in_their_room(t):
    """Each foreign library is seen by one room; tests and benches may use them as baselines."""
    homes = {r"\blws_|libwebsockets|\bLWS_": "src/net/", r"simdjson": "src/json/", r"dragonbox": "src/json/",
             r"openssl/": ("src/access/", "src/net/tls/", "tools/rowe/setup/certificate", "tools/ros1/md5"),
             r"#include <(ros|xmlrpcpp)/": "tools/ros1/",
             r"toml\+\+/": "src/config/toml_file.cpp",
             r"qrencode\.h": "tools/rowe/setup/qr_code",
             r"curses\.h": "tools/rowe/live/screen",
             r"<png\.h>|PNG_IMAGE": "tools/rowe/plot/png",
             r"ft2build\.h|FT_FREETYPE_H": "tools/rowe/plot/lettering",
             r"lz4frame|zstd\.h|zlib\.h": "src/mcap/",
             r"moodycamel|concurrentqueue": "src/service/threads/number_queue"}
    for pattern, home in homes.items():
        homes_of_it = (home,) if isinstance(home, str) else home
        elsewhere = [path for path in t.within(product) if not path.startswith(homes_of_it)]
        what = "{} belongs to " + " and ".join(homes_of_it)
        yield from matches(t, elsewhere, pattern, "library-room", what, raw=True)


def arrows(t):
    """room -> the rooms it may see, from src/CMakeLists.txt: `rowe_room(wire rowe_json)`, transitively."""
    calls = re.findall(r"(?m)^rowe_room\((\w+)([^)]*)\)", "\n".join(t.lines("src/CMakeLists.txt")))
    direct = {room: set(re.findall(r"rowe_(\w+)", links)) for room, links in calls}
    direct["page"] = {"service"}  # in a CMakeLists.txt of its own
    direct["api"] = {*direct}
    direct["capi"] = {"api"}

    def reached(room):
        return {room}.union(*(reached(other) for other in direct.get(room, ())))

    return {room: reached(room) for room in direct}


# Narrower than the link says: of that room only these headers.
narrowed = {(room, "service"): {"service/base/transport.hpp"} for room in ("net", "page")}


def rooms_include_along_the_arrows(t):
    allowed = arrows(t)
    for path in t.within(["src"]):
        room = path.split("/")[1]
        for number, line in enumerate(t.lines(path), 1):
            named = re.match(r'\s*#\s*include\s+"((\w+)/[^"]+)"', line)
            if not named:
                continue
            header, other = named[1], named[2]
            few = narrowed.get((room, other), {header})
            if other not in allowed.get(room, {room}):
                yield finding(path, number, "arrow", f"{room} must not see {other}: {header}")
            elif header not in few:
                yield finding(path, number, "arrow", f"of {other}, {room} sees only {', '.join(sorted(few))}")


kernel_headers = re.compile(
    r"(sys|arpa|net|netinet|linux|asm)/\w+\.h|"
    r"(dirent|dlfcn|errno|execinfo|fcntl|ifaddrs|link|malloc|netdb|poll|pthread|pwd|sched|semaphore|signal|"
    r"spawn|stdlib|string|syscall|termios|time|ucontext|unistd)\.h")
# What set-up, pictures and the live view are made with, and the program alone; libraries_stay_in_their_room()
# says where.
program_headers = re.compile(r"openssl/\w+\.h|qrencode\.h|curses\.h|png\.h|ft2build\.h")
c_types = re.compile(r"std(bool|def|int)\.h")
c_headers = re.compile(r"(inttypes|math|signal|std(bool|def|int|io|lib)|string|time)\.h")


def c_may_include(path, name):
    """The headers of C and our own; of the interface's headers, those that need no more than C's types."""
    if name.startswith("rowe/"):
        return name.endswith(".h")
    return (c_types if path.startswith("include/") else c_headers).fullmatch(name)


def outsiders_include_the_interface_only(t):
    """include/ needs std and rowe; rt/ std and the kernel; tools and examples all three."""
    for folder, kernel in (("include", False), ("rt", True), ("tools", True), ("docs/examples", True)):
        for path in t.within([folder]):
            for number, line in enumerate(t.lines(path), 1):
                named = re.match(r'\s*#\s*include\s+(["<])([^" >]+)[">]', line)
                if not named:
                    continue
                quoted, name = named[1] == '"', named[2]
                if path.endswith((".h", ".c")):
                    if quoted or not c_may_include(path, name):
                        yield finding(path, number, "interface", f"C in {folder} may not include {name}")
                    continue
                target = os.path.normpath(os.path.join(os.path.dirname(path), name))
                beside = target.startswith(folder + "/") and t.exists(target)
                own = name.startswith("rowe/rt/" if folder == "rt" else "rowe/")
                standard = re.fullmatch(r"\w+", name) or (kernel and kernel_headers.fullmatch(name)) or (
                    folder == "tools" and program_headers.fullmatch(name)) or (
                    path.startswith("tools/ros1/") and re.fullmatch(r"((ros|xmlrpcpp)/\w+|fnmatch)\.h", name))
                if not (beside if quoted else own or standard):
                    yield finding(path, number, "interface", f"{folder} may not include {name}")


# ---- what must not be called


def no_fences_and_no_volatile(t):
    """TSan cannot model fences, and volatile orders nothing."""
    pattern = r"\batomic_(thread|signal)_fence\b|__sync_synchronize|\b_mm_[lms]fence\b|\bvolatile\b"
    yield from matches(t, t.within((*library, "tools")), pattern, "banned-word", "{} orders nothing here")


def the_library_neither_prints_nor_ends_the_program(t):
    pattern = (r"\b(?:v?f?printf|puts|fputs|putchar|perror|fwrite)\s*\(|<iostream>|"
               r"\bstd::(?:cout|cerr|clog)\b|\b(?:abort|exit|_exit|quick_exit|terminate)\s*\(")
    yield from matches(t, t.within(library), pattern, "no-output-no-abort", "{}: return an error, or count")


def the_core_has_no_clock_and_no_chance(t):
    """src/service and src/wire are functions of their arguments."""
    pattern = (r"\bclock_gettime\b|\b(?:steady|system|high_resolution|monotonic)_clock\b|\bs?rand\s*\(|"
               r"\brandom_device\b|\bmt19937|\bgetrandom\b|\bthis_thread\b|\bgettid\b|\bpthread_self\b")
    core = t.within(["src/service", "src/wire"])
    yield from matches(t, core, pattern, "core-is-a-function", "{}: comes in as an argument")


def the_service_names_no_codec(t):
    """src/service knows codecs, and not which, also in strings and comments. What users set and read is
    called after one of them."""
    names = (r"(?<![a-z])(?:rosbridge|hop|foxglove)(?![a-z])|wire::plain|plain_codec|is_plain_?\b|"
             r"websocket_profile|wire/plain/|wire/\w+/\w+_(?:codec|decoder)\.hpp")
    pattern = re.compile(names, re.IGNORECASE)
    for path in t.within(["src/service"]):
        for number, line in enumerate(t.lines(path), 1):
            for found in pattern.findall(line):
                yield finding(path, number, "codec", f"{found}: only src/wire knows which codecs there are")


def tests_do_not_sleep(t):
    instead = "{}: wait for what is to happen"
    pattern = r"\bthis_thread::sleep_(for|until)\b|\bu?sleep\s*\(\s*\d|\bnanosleep\s*\("
    yield from matches(t, t.within(["tests"]), pattern, "no-sleep-in-tests", instead)
    scripts = [path for path in t.within(["tests"], (".py",)) if not path.startswith("tests/tidy/")]
    yield from matches(t, scripts, r"\btime\.sleep\b", "no-sleep-in-tests", instead)


def tests_are_compiled(t):
    """A file of tests that its folder's list does not name would never run."""
    for path in t.within(("tests",), ("_test.cpp",)):
        folder = os.path.dirname(path)
        while folder and not t.exists(os.path.join(folder, "CMakeLists.txt")):
            folder = os.path.dirname(folder)
        listed = os.path.join(folder, "CMakeLists.txt")
        name = os.path.relpath(path, folder).removesuffix("_test.cpp")
        if not t.exists(listed) or not re.search(rf"\b{name}\b", t.text(listed)):
            yield finding(path, 1, "unlisted-test", f"no list in {listed} names {name}")


def errors_are_not_swallowed(t):
    pattern = r"\bcatch\s*\(\s*\.\.\.\s*\)"
    yield from matches(t, t.within((*library, "tools")), pattern, "catch-all", "{} hides what it catches")


def comments_above(lines, number):
    """What the comments near a line say: those of the four lines above it, a block of them as a whole."""
    said, reach = [], 4
    while number > 0 and reach > 0:
        number -= 1
        if "//" not in lines[number]:
            reach -= 1
        said.append(lines[number].partition("//")[2])
    return " ".join(said)


def orders_name_their_partner(t):
    """An order other than seq_cst has a comment beside it, or one above that names its partner or reason."""
    order = re.compile(r"\bmemory_order(?:_|::)(relaxed|acquire|release|acq_rel|consume)\b")
    for path in t.within((*library, "tools")):
        lines = t.lines(path)
        for number, line in enumerate(t.code(path)):
            for name in order.findall(line):
                beside = lines[number].partition("//")[2].split()
                near = re.search(rf"\bpairs?\b|\b{name}s?\b", comments_above(lines, number))
                if len(beside) < 2 and not near:
                    yield finding(path, number + 1, "order", f"{name}: no comment names its partner")


def partners_exist(t):
    """What a comment names as the partner of an access is a function somewhere."""
    named = re.compile(r"\b(\w+)\(\)")
    functions = {name for path in t.within(library) for line in t.code(path)
                 for name in re.findall(r"\b(\w+)\s*\(", line)}
    for path in t.within(library):
        for number, line in enumerate(t.lines(path), 1):
            said = line.partition("//")[2].partition("pairs with")[2]
            for name in named.findall(said):
                if name not in functions:
                    yield finding(path, number, "order", f"{name}(): there is no such function")


def a_pairs_words_have_one_home(t):
    """The explorer runs pair_lifecycle.hpp as it is. Its words are private, which the compiler sees to; this
    sees that nobody makes others of their kind."""
    home = "include/rowe/detail/pair_lifecycle.hpp"
    elsewhere = [path for path in t.within((*product, "tests", "bench")) if path != home]
    pattern = r"\b(variable|plain|atomic|atomic_ref)\s*<\s*(\w+::)*(pair_phase|audience)\s*>"
    yield from matches(t, elsewhere, pattern, "pair-word", "{}: such words belong to " + home)


# ---- how files look


def sources_name_their_licence(t):
    for path in t.sources():
        if not any("SPDX-License-Identifier: Apache-2.0" in line for line in t.lines(path)[:3]):
            yield finding(path, 1, "spdx", "the first lines name no licence")


def lines_fit(t):
    """Lines with an address, and tables (between `clang-format off` and `on`), may be longer."""
    for path in t.sources():
        if path.endswith((".svg", ".html")):
            continue
        table = False
        for number, line in enumerate(t.lines(path), 1):
            table = (table or "clang-format off" in line) and "clang-format on" not in line
            if len(line) > columns_max and not table and "://" not in line:
                yield finding(path, number, "columns", f"{len(line)} columns; {columns_max} fit")


lines_max = 400
# path: (lines, why they belong together). What is longer may shrink, and is taken off this list then.
longer = {}


def files_are_short(t):
    for path in t.within(library):
        count = len(t.lines(path)) - 1  # the last one is what follows the last line break
        fit, _ = longer.get(path, (lines_max, ""))
        if count > fit:
            yield finding(path, 1, "length", f"{count} lines; {fit} fit")
    for path in longer:
        if not t.exists(path) or len(t.lines(path)) - 1 <= lines_max:
            yield finding("tests/tidy/tidy.py", 1, "length", f"{path} is no longer longer")


def white_space_is_plain(t):
    for path in t.texts():
        lines = t.lines(path)
        for number, line in enumerate(lines, 1):
            if "\t" in line or "\r" in line:
                yield finding(path, number, "white-space", "a tab or a carriage return")
            elif line != line.rstrip() and not path.endswith(".md"):  # there, two blanks break a line
                yield finding(path, number, "white-space", "blanks at the end of the line")
        if lines[-1:] != [""]:
            yield finding(path, len(lines), "white-space", "no line break at the end of the file")


# Written in two halves, so that this file does not offend against its own rules.
open_ends = "|".join(("TO" "DO", "FIX" "ME", "XX" "X", "HA" "CK"))
machines = "|".join(("/wo" "rk/", "/ro" "ot/", "/ho" "me/", "/tmp/bu" "ild"))


def nothing_is_left_open(t):
    yield from matches(t, t.texts(), rf"\b({open_ends})\b", "left-open", "{}", raw=True)


def no_machine_is_named(t):
    pattern = rf"(?<![\w.])({machines})"
    yield from matches(t, t.texts(), pattern, "machine", "{} is a path of one machine", raw=True)


# ---- what texts say of other files

named_file = re.compile(
    r"(?<![\w./\-}$<])(?:(?:include|src|tools|tests|bench|docs)/|rt/(?:include|src|tripwire)/|\.ci/)"
    r"[\w./*\-]*(?:\{[\w,]+\}[\w./*\-]*)?")


def spelt_out(name):
    """`a/{b,c}.hpp` is two names."""
    braces = re.search(r"\{([\w,]+)\}", name)
    if not braces:
        return [name]
    return [name[:braces.start()] + one + name[braces.end():] for one in braces[1].split(",")]


def is_there(t, name):
    if "*" in name:
        pattern = re.escape(name).replace(r"\*", "[^/]*")
        return any(re.fullmatch(pattern, path) for path in t.paths)
    return t.exists(name) or t.exists(name + ".hpp")


def named_files_exist(t):
    """A path from the top of the tree, in prose, a comment or a CMake file, leads somewhere."""
    for path in t.texts():
        if path.startswith("tests/tidy/") or path.endswith((".json", ".svg")):
            continue
        for number, line in enumerate(t.lines(path), 1):
            if path.endswith(code_suffixes):
                line = line.partition("//")[2]
            for name in named_file.findall(line):
                for one in spelt_out(name.rstrip("./-,")):
                    # NAME stands for a name; node_modules comes with the first `npm ci`.
                    exempt = re.search(r"\b[A-Z]{3,}\b|/node_modules$", one)
                    if not exempt and not is_there(t, one):
                        yield finding(path, number, "named-file", f"there is no {one}")


def anchors(t, path):
    """What a heading is called in a link, as GitHub makes it up."""
    headings = (re.match(r"#+\s+(.*)", line) for line in t.lines(path))
    return {re.sub(r"[^\w\- ]", "", h[1].strip().lower()).replace(" ", "-") for h in headings if h}


def blocks(lines, language):
    """(number, line) of each line in a language in Markdown, block by block."""
    block = None
    for number, line in enumerate(lines, 1):
        if line.startswith("```"):
            if block:
                yield block
            block = [] if line.strip() == "```" + language else None
        elif block is not None and line.strip():
            block.append((number, line))


def first_missing(block, example):
    rest = iter(example)
    return next((one for one in block if one[1] not in rest), None)


def documented_code_is_compiled(t):
    """C++ in Markdown stands in one of docs/examples, line by line in its order, and CMake in one of the
    projects of tests/install; lines may be left out."""
    for language, folder, suffix in (("cpp", "docs/examples", ".cpp"),
                                     ("cmake", "tests/install", "/CMakeLists.txt")):
        examples = [t.lines(path) for path in t.within([folder], (suffix,))]
        for path in t.paths:
            for block in blocks(t.lines(path) if path.endswith(".md") else (), language):
                missing = [first_missing(block, example) for example in examples]
                if None not in missing:
                    number, line = max(missing, default=block[0])  # of the example that goes furthest
                    yield finding(path, number, "example", f"in no file of {folder}: {line.strip()}")


def examples_are_shown(t):
    """Each of docs/examples is linked from the README or a page of docs, or nobody finds it."""
    pages = [t.text(path) for path in t.paths if re.fullmatch(r"README\.md|docs/[\w-]+\.md", path)]
    for path in t.within(["docs/examples"], (".cpp", ".c", ".html")):
        link = re.compile(rf"\]\((docs/)?examples/{re.escape(os.path.basename(path))}\)")
        if not any(link.search(page) for page in pages):
            yield finding(path, 1, "unlinked-example", "no page of docs links it")


def links_lead_somewhere(t):
    for path in t.paths:
        fenced = False
        for number, line in enumerate(t.lines(path) if path.endswith(".md") else (), 1):
            fenced ^= line.lstrip().startswith("```")
            prose = "" if fenced else re.sub(r"`[^`]*`", "", line)
            for to in re.findall(r"\]\(<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\)", prose):
                if re.match(r"[a-z]+:", to):
                    continue
                file, _, anchor = to.partition("#")
                target = os.path.normpath(os.path.join(os.path.dirname(path), file)) if file else path
                if not t.exists(target):
                    yield finding(path, number, "link", f"{to} leads nowhere")
                elif anchor and target.endswith(".md") and anchor not in anchors(t, target):
                    yield finding(path, number, "link", f"{target} has no heading #{anchor}")


# ---- words

# Whose words are the field's (docs/concepts.md): all but this file and its test, which name the others.
worded = re.compile(
    r"(?!tests/tidy/tidy)"
    r"(CMakeLists|CONTRIBUTING|README|bench/|clients/|docs/|include/|rt/|src/|tests/|tools/)")
# A word that is gone, also as a part of a name, in the plural, and in capitals: what is said instead.
replaced = {
    "bell": "waker", "carrier": "transport", "complaint": "diagnostic, protocol error", "dialect": "codec",
    "dice": "random", "farewell": "close reason", "front door": "submission queue, shared inbox",
    "goodbye": "close frame", "it rings": "it writes to", "lane_bytes": "handle_bytes",
    "lanes_max": "handles_max", "mend": "fix", "mended": "fixed", "nap": "yield",
    "patience": "time_max, timeout", "phase plan": "publish predictor", "put aside": "parked",
    "room_bytes": "buffer_bytes, capacity_bytes", "rope": "producer epoch", "settler": "service thread",
    "tell_room": "notify_room", "theatre": "harness", "teller": "announcer", "told_full": "marked_full",
    "unkeep": "unpin", "weather": "link conditions"}
# Likewise, where it says nothing else: letters of the alphabet, people, sentences of a page.
product_code = ("include/", "rt/", "src/")
replaced_within = [
    (("docs/", "include/", "src/", "tests/api/", "tests/model/", "tests/service/", "tests/sim/"),
     {"letter": "direct message"}),
    (product_code + ("bench/", "tests/"), {"near peer": "low-RTT peer"}),
    (product_code, {
        "all_the_same": "what it does otherwise", "decode_room": "decode_buffers", "guest": "handshake",
        "hand_in": "write_request", "http_refusal": "http_rejection", "lives_no_longer": "expires_this_cycle",
        "on_refused": "on_rejected", "owe": "pending", "parting": "closing", "to_peers": "transport"}),
    (("src/api/", "src/capi/", "src/json/", "src/net/", "src/service/", "src/wire/"),
     {"sentence": "diagnostic"}),
    (("src/service/",), {"dead": "expired", "draw": "seed, nonce", "drawn": "chosen, made"})]
# Characters; `dialect` is a member on the wire, and the column that shows it.
named_elsewhere = (
    "`dialect`", '"dialect"', '"DIALECT"', "bell \\\\u0007", '"bell", "X: \\a"', "is_letter_or_digit",
    "letter-spacing", "letters, digits", "Letters of ASCII")


def words_are_the_fields(t):
    lists = [((), replaced), *replaced_within]
    gone = "|".join(word.replace(" ", "[ _]") for _, words in lists for word in words)
    pattern = re.compile(rf"(?<![a-z])({gone})s?(?![a-z])", re.IGNORECASE)
    names = re.compile(rf"(?<!\w)({'|'.join(map(re.escape, named_elsewhere))})(?!\w)")
    met = set()

    def has_none(path):
        return not worded.match(path) or not (may_match(pattern, t.text(path)) or
                                              may_match(names, t.text(path)))

    for path in t.texts():
        instead = {word: said for folders, words in lists if not folders or path.startswith(folders)
                   for word, said in words.items()}
        for number, line in enumerate(() if has_none(path) else t.lines(path), 1):
            met.update(names.findall(line))
            for word in pattern.findall(names.sub("", line)):
                said = instead.get(word.lower()) or instead.get(word.lower().replace("_", " "))
                if said:
                    yield finding(path, number, "word", f"{word}: {said}")
    for name in sorted(set(named_elsewhere) - met):
        yield finding("tests/tidy/tidy.py", 1, "word", f"nothing is called {name} any more")


rules = (
    libraries_stay_in_their_room, rooms_include_along_the_arrows, outsiders_include_the_interface_only,
    no_fences_and_no_volatile, the_library_neither_prints_nor_ends_the_program,
    the_core_has_no_clock_and_no_chance, the_service_names_no_codec, tests_do_not_sleep, tests_are_compiled,
    errors_are_not_swallowed, orders_name_their_partner, partners_exist, a_pairs_words_have_one_home,
    sources_name_their_licence, lines_fit, files_are_short, white_space_is_plain, nothing_is_left_open,
    no_machine_is_named, named_files_exist, documented_code_is_compiled, examples_are_shown,
    links_lead_somewhere, words_are_the_fields, *inside.rules)


def found_by_rules(root):
    """What each rule finds, in their order."""
    t = tree(root)
    return [list(rule(t)) for rule in rules]


def without_exempt(found_by):
    """All findings that are not excused, sorted."""
    found, used = [], set()
    for one in (one for found_by_rule in found_by for one in found_by_rule):
        if (one.path, one.rule) in exempt:
            used.add((one.path, one.rule))
        else:
            found.append(one)
    stale = sorted(set(exempt) - used)
    found += [finding(path, 1, "exempt", f"nothing is excused from {rule} any more") for path, rule in stale]
    return sorted(found)


if __name__ == "__main__":
    here = os.path.dirname(os.path.abspath(__file__))
    top = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "..", "..")
    offences = without_exempt(found_by_rules(top))
    for one in offences:
        print(f"{one.path}:{one.line}: {one.rule}: {one.what}")
    sys.exit(1 if offences else 0)
