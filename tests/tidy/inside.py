# SPDX-License-Identifier: Apache-2.0
"""Rules about the folders of src and the parts of src/service: what includes what goes one way, and
docs/inside.md shows the code as it is.

Of the page are checked: its picture (all folders, in their order), a section for each folder with a table
of its parts, and the journeys, which are nested lists of steps `FILE: FUNCTION`. An indented step is called
by the one above it that is indented less, and steps side by side are called in their order; a step that is
not indented is called from outside, and those of src/service belong to core."""
import functools
import re

from cpp import close, program
from tree import finding

page = "docs/inside.md"
parts_header = "src/service/core/core_parts.hpp"
state_header = "src/service/state/core_state.hpp"
entrances = ("core/core.", "core/service_loop.")

# The folders of a room from the ground up: a file includes those of its own folder, and of folders before it.
folders = {
    "service": ("base threads state outgoing incoming control topics calls stop parameters reports graph "
                "requests handles core").split(),
    "json": "text reading writing structs".split(),
    "wire": "text websocket http codec plain rosbridge foxglove protocols".split(),
    "net": "base http lws tls connections handshakes client transport".split(),
}
# The line that says in one header of each folder of src/service what lives there, and what does not.
house_rule = re.compile(r"// Folder (\w+): [^.]+\. \S.*\.$")


def _stem(path):
    return re.sub(r"\.\w+$", "", path.rpartition("/")[2])


def _included(t, path):
    """(line, name) of what a file of src/service includes of it."""
    for number, line in enumerate(t.lines(path), 1):
        named = re.match(r'\s*#\s*include\s+"service/\w+/(\w+)\.hpp"', line)
        if named and named[1] != _stem(path):
            yield number, named[1]


def files_lie_in_folders_that_include_downwards(t):
    for room, order in folders.items():
        include = re.compile(rf'\s*#\s*include\s+["<](?:\.\./|{room}/)(\w+)/')
        paths = t.within([f"src/{room}"])
        for empty in [folder for folder in order if not any(f"/{folder}/" in path for path in paths)]:
            yield finding(f"src/{room}/{empty}", 1, "folder", "there is nothing in it")
        for path in paths:
            folder, name = path.removeprefix(f"src/{room}/").partition("/")[::2]
            if folder not in order or "/" in name:
                yield finding(path, 1, "folder", f"lies in no folder of {', '.join(order)}")
                continue
            for number, line in enumerate(t.lines(path), 1):
                other = include.match(line)
                if other and other[1] in order[order.index(folder) + 1:]:
                    yield finding(path, number, "folder", f"{other[1]} stands above {folder}")


def each_folder_says_what_lives_there(t):
    said = {}
    for path in t.within(["src/service"], (".hpp",)):
        for number, line in enumerate(t.lines(path), 1):
            rule = house_rule.match(line)
            if rule:
                said.setdefault(path.split("/")[2], []).append((path, number, rule[1]))
    for folder in folders["service"]:
        rules = said.get(folder, [])
        if len(rules) != 1 or rules[0][2] != folder:
            path, number, _ = rules[-1] if rules else (f"src/service/{folder}", 1, "")
            yield finding(path, number, "folder",
                          f"one header says `// Folder {folder}: what lives there. What does not.`")


@functools.lru_cache(maxsize=1)
def _files(t):
    """The header and the source of each name."""
    files = {}
    for path in t.within(["src/service"]):
        files.setdefault(_stem(path), []).append(path)
    return files


@functools.lru_cache(maxsize=1)
def _program(t):
    return program(t)


def _parts(t):
    """(line, class, file) of each table of core_state and each member of core_parts."""
    code = _program(t)
    for path, member in ((state_header, r"  (\w+) \w+;"), (parts_header, r"  (?!core_state)(\w+) \w+_;")):
        for number, line in enumerate(t.code(path) if path in t.paths else (), 1):
            named = re.match(member, line)
            home = code.home.get(named[1]) if named else None
            if home and home.files[0].startswith("src/service/"):
                yield number, named[1], _stem(home.files[0])


def parts_are_made_after_those_they_include(t):
    parts = list(_parts(t))
    class_in, made = {file: name for _, name, file in parts}, set()
    for number, name, file in parts:
        made.add(file)
        for one in _included_parts(t, file, class_in):
            if one not in made:
                yield finding(parts_header, number, "part-order", f"{name} is made before {class_in[one]}")


def parts_have_one_name(t):
    """A member that is a part, or refers to one, is called after its class, and so is all that a part needs,
    but for the state."""
    parts = {name for _, name, file in _parts(t) if name not in _tables(t)}
    for path in t.within(["src/service"], (".hpp",)):
        needed = False
        for number, line in enumerate(t.code(path), 1):
            needed = (needed or re.match(r"struct \w+_needs \{", line)) and line != "};"
            member = re.match(r"  (?:const )?(\w+)(&| ) ?(\w+)_;", line)
            need = needed and member and member[2] == "&" and member[1] != "core_state"
            if member and (member[1] in parts or need) and member[1] != member[3]:
                yield finding(path, number, "part-name", f"{member[3]}_: call it {member[1]}_")


def _tables(t):
    """What core_state has, by short names."""
    lines = t.code(state_header) if state_header in t.paths else ()
    return {named[1] for named in (re.match(r"  (\w+) \w+;", line) for line in lines) if named}


def rows_have_typed_indices(t):
    for path in t.within(["src/service"]):
        for number, line in enumerate(t.code(path), 1):
            if re.search(r"\bno_index\b", line):
                yield finding(path, number, "no-index", "no_index: indices of ids.hpp know it themselves")


def limits_are_tied(t):
    """What depends on another limit says so where it stands."""
    header = "src/service/base/service_limits.hpp"
    headers = [one for one in (header, "src/service/base/work.hpp") if one in t.paths]
    tied = sum("static_assert(" in line for one in headers for line in t.code(one))
    if tied < asserted_limits:
        yield finding(header, 1, "limits", f"{tied} static_asserts tie limits; there were {asserted_limits}")


# Who asks the gate what a request wants of the stop, and how often: once each for what a peer said, for a
# call of this process and for one of a peer that is no stop; and for the endpoint's own list of services.
asks_the_gate = {"request_router.cpp": 1, "call_router.cpp": 2, "numbered.cpp": 1}


def the_stop_is_recognised_at_the_gate(t):
    for path in t.within(["src/service"]):
        asked, allowed = 0, asks_the_gate.get(path.rpartition("/")[2], 0)
        for number, line in enumerate(t.code(path), 1):
            asked += len(re.findall(r"\bstop_gate::(?:find|asks_to_stop|service_named)\(", line))
            if asked > allowed and _stem(path) != "stop_gate":
                yield finding(path, number, "stop-gate", f"asks the gate {asked} times; {allowed} are known")
                break


# ---- the page


def _chapter(t, title):
    """(number, line) below a heading of the second level, with it."""
    inside = False
    for number, line in enumerate(t.lines(page), 1):
        if line.startswith("## "):
            inside = line == "## " + title
        if inside:
            yield number, line


def _first_difference(told, right, start, where):
    """Of (line, name) on the page from what is right."""
    end = "nothing more"
    told = told + [(start, end)] * (len(right) + 1)
    for (number, name), other in zip(told, right + [end] * len(told)):
        if name != other:
            yield finding(page, number, "inside", f"{other} comes here {where}, not {name}")
            return


def the_page_draws_the_folders(t):
    """The first word of each line of the picture: the folders, the ground last."""
    lines, fence = [], 0
    for number, line in enumerate(t.lines(page), 1):
        fence += line.startswith("```")
        word = re.match(r"  (\w+) ", line)
        if fence == 1 and word:
            lines.append((number, word[1]))
    start = next((number for number, _ in _chapter(t, "The folders")), 1)
    yield from _first_difference(lines, folders["service"][::-1], start, "in the picture")


def the_page_has_a_section_for_each_folder(t):
    """With a table of its parts, in the order in which they are made."""
    names = [(number, line[3:]) for number, line in enumerate(t.lines(page), 1)
             if line.startswith("## ") and line[3:].islower()]
    yield from _first_difference(names, folders["service"], 1, "among the sections")
    parts = {}
    for _, name, file in _parts(t):
        parts.setdefault(_files(t)[file][0].split("/")[2], []).append(name)
    for start, folder in names:
        rows = [(number, match[1]) for number, match in
                ((number, re.match(r"\| `(\w+)` \|", line)) for number, line in _chapter(t, folder)) if match]
        yield from _first_difference(rows, parts.get(folder, []), start, "in core_parts.hpp")


def _included_parts(t, file, parts):
    """The parts that a part includes itself, or by a header that is none."""
    found, seen, left = set(), {file}, [file]
    while left:
        one = left.pop()
        for path in _files(t).get(one, ()):
            for _, name in _included(t, path):
                if name not in seen:
                    seen.add(name)
                    (found.add if name in parts else left.append)(name)
    return sorted(found)


steps_max = 12  # of each of the four journeys: who reads them sees the whole


def the_four_journeys_are_short(t):
    title, steps, journeys = None, 0, 0
    for number, line in [*_chapter(t, "Four journeys"), (0, "### ")]:
        if line.startswith("### "):
            journeys += steps > 0
            if title and steps > steps_max:
                yield finding(page, title, "inside", f"{steps} steps; {steps_max} fit")
            title, steps = number, 0
        steps += bool(re.match(r" *\d+\. ", line))
    if journeys != 4:
        yield finding(page, 1, "inside", f"{journeys} journeys have steps; there are four")


def _named_place(code):
    """(path, function) of `FILE: FUNCTION`; a file without src or include lies in src/service."""
    file, _, function = code.partition(": ")
    return file if file.startswith(("src/", "include/")) else "src/service/" + file, function


def the_places_on_the_page_are_there(t):
    code = _program(t)
    for number, line in enumerate(t.lines(page), 1):
        for place in re.findall(r"`([\w/]+\.[ch]pp: \w+)`", line):
            path, function = _named_place(place)
            if path not in t.paths:
                yield finding(page, number, "inside", f"there is no {path}")
            elif not code.unit(path).bodies(function, path):
                yield finding(page, number, "inside", f"{path} defines no {function}")


def the_journeys_go_as_the_page_says(t):
    code = _program(t)
    above = []  # of each step around the next one: depth, file, function, and its calls that are left
    if not any(_chapter(t, "Four journeys")):
        yield finding(page, 1, "inside", "there are no journeys")
    for number, line in enumerate(t.lines(page), 1):
        if line.startswith("#"):
            above = []
        step = re.match(r"( *)\d+\. ", line)
        if not step:
            continue
        named = re.match(r"`([\w/]+\.[ch]pp: \w+)`", line[step.end():])
        if not named:
            yield finding(page, number, "inside", "a step begins with `FILE: FUNCTION`")
            continue
        depth = len(step[1])
        path, function = _named_place(named[1])
        if path not in t.paths or not code.unit(path).bodies(function, path):
            continue
        while above and above[-1][0] >= depth:
            above.pop()
        if above:
            _, caller, calling, left = above[-1]
            here = next((at for at, (kind, name) in enumerate(left, 1)
                         if name == function and code.is_of(kind, path)), None)
            del left[:here or 0]
            if here is None:
                yield finding(page, number, "inside",
                              f"{calling} of {caller} does not call {function} of {path}, or not here")
        elif path.startswith("src/service/") and not path.startswith(entrances, len("src/service/")):
            yield finding(page, number, "inside", f"{path} is not called from outside src/service")
        above.append((depth, path, function, list(code.calls(code.unit(path), function))))


asserted_limits = 34
# Lines of a header and its source. What is larger may shrink, and is taken off this list then.
part_lines_max = 400
larger = {"core": 526, "ingress": 424, "long_ingress": 485, "outbox": 435,
          "publish_predictor": 401, "stop_rules": 560, "subscription_queues": 442}


def the_page_shows_the_transport(t):
    """Its table has all folders of src/net; a word in its picture with a `_` is a file of src/net."""
    of_net = {_stem(path) for path in t.within(["src/net"], (".hpp",))}
    rows, named, block = [], {}, False
    for number, line in _chapter(t, "The transport"):
        block = block != line.startswith("```")
        row = re.match(r"\| `(\w+)` \|", line)
        rows += [row[1]] if row else []
        named.update((word, number) for word in re.findall(r"\w+", line) if block or "`" in line)
    start = next((number for number, _ in _chapter(t, "The transport")), 1)
    if rows != folders["net"]:
        yield finding(page, start, "inside", f"the transport's folders are {', '.join(folders['net'])}")
    for word, number in named.items():
        if "_" in word and word not in of_net:
            yield finding(page, number, "inside", f"src/net has no {word}")


def parts_are_small(t):
    sizes = {}
    for path in t.within(["src/service"]):
        name = _stem(path)
        if name == "core_parts":  # as long as there are parts
            continue
        sizes[name] = sizes.get(name, 0) + len(t.lines(path)) - 1
        if sizes[name] > larger.get(name, part_lines_max):
            yield finding(path, 1, "size", f"{name} has {sizes[name]} lines, header and source; "
                          f"{larger.get(name, part_lines_max)} fit")
    for name in larger:
        if sizes.get(name, 0) <= part_lines_max:
            yield finding("tests/tidy/inside.py", 1, "size", f"{name} is no longer larger")


# Of a class of src/service: public functions, functions in all, data members, and the parts that it is given
# besides the state. What has more may shrink, and is taken off this list then.
class_bounds = {"public": 25, "functions": 45, "members": 15, "needs": 8}
beyond = {
    # The parts themselves (as many as there are), and those that hand on to most of them.
    "core_parts": {"members": float("inf")},
    "request_router": {"needs": 11},
    "call_router": {"needs": 9},
    "handle_registry": {"needs": 10},
    "handle_submissions": {"needs": 10},
    "topic_handles": {"needs": 10},
    "broker": {"needs": 9},
    "core": {"public": 27, "functions": 47},
    # They hand on some of what they are given to a member that needs it, too.
    "connection_graph": {"members": 16},
    "listings": {"members": 16},
    # Tables and queues, whose functions are a line or two for one field or one end.
    "slot_pool": {"public": 54, "functions": 60},
    "chunk_store": {"public": 29},
    "outbox": {"public": 27},
    # One algorithm each.
    "stop_rules": {"members": 21},
    "publish_predictor": {"members": 16},
}


def _flat(text):
    """A class's body with what is in braces within it left out."""
    flat, depth = [], 0
    for one in text:
        depth += one == "{"
        if depth == 0:
            flat.append(one)
        elif one == "}":
            depth -= 1
            flat.append(";" if depth == 0 else "")
    return "".join(flat)


def _sizes(header):
    """(line, class, {what: how many}) of each class in the text of a header. What a part needs are members of
    it."""
    for found in re.finditer(r"(?m)^class (\w+)[^;{]*\{", header):
        end = close(header, found.end() - 1, "{}")
        body = header[found.end():end - 1]
        access, count = "private", dict.fromkeys(class_bounds, 0)
        for statement in re.split(r"(\b(?:public|private|protected):)|;", _flat(body)):
            statement = (statement or "").strip()
            if statement.endswith(":") and statement[:-1] in ("public", "private", "protected"):
                access = statement[:-1]
            elif re.match(r"$|,|(using|friend|static_assert|enum|struct|class)\b|.*= delete$", statement):
                continue  # a comma: how a constructor goes on
            elif "(" in statement:
                count["functions"] += 1
                count["public"] += access == "public"
            elif not statement.startswith("static "):
                count["members"] += 1
        needs = re.search(rf"struct {found[1]}_needs \{{([^}}]*)\}}", header)
        if needs:
            count["needs"] = len(re.findall(r"& (?!state_;)\w+;", needs[1]))
            count["members"] += needs[1].count(";")
        yield header.count("\n", 0, found.start()) + 1, found[1], count


def classes_are_small(t):
    there = set()
    for path in t.within(["src/service"], (".hpp",)):
        for line, name, count in _sizes("\n".join(t.code(path))):
            there.add(name)
            for what, bound in class_bounds.items():
                allowed = beyond.get(name, {}).get(what, bound)
                if count[what] > allowed:
                    yield finding(path, line, "size", f"{name}, {what}: {count[what]}; {allowed} fit")
                elif bound < allowed < float("inf") and count[what] <= bound:
                    yield finding("tests/tidy/inside.py", 1, "size", f"{name}, {what}: no longer beyond")
    for name in sorted(set(beyond) - there):
        yield finding("tests/tidy/inside.py", 1, "size", f"src/service has no class {name}")


rules = (files_lie_in_folders_that_include_downwards, each_folder_says_what_lives_there,
         parts_are_made_after_those_they_include, parts_have_one_name, rows_have_typed_indices,
         limits_are_tied, the_stop_is_recognised_at_the_gate, the_page_draws_the_folders,
         the_page_has_a_section_for_each_folder, the_page_shows_the_transport, the_four_journeys_are_short,
         the_places_on_the_page_are_there, the_journeys_go_as_the_page_says, parts_are_small,
         classes_are_small)
