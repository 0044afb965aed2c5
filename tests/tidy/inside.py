# SPDX-License-Identifier: Apache-2.0
"""Rules about the parts of src/service: calls go one way, and docs/inside.md shows the code as it is.

Of the page are checked: the picture (what a part includes stands on a lower line), the table (all parts, in
the order in which they are made), and the journeys, which are nested lists of steps `FILE: FUNCTION`. An
indented step is called by the one above it that is indented less, and steps side by side are called in their
order; a step that is not indented is called from outside, and those of src/service belong to core."""
import functools
import re

from cpp import close, program
from tree import finding

page = "docs/inside.md"
parts_header = "src/service/core/core_parts.hpp"
state_header = "src/service/state/core_state.hpp"
entrances = ("core.", "service_loop.")

# What a file of src/service includes stands in front of it: nothing is called upwards.
service_order = """
ids index_list indexed_pool index_ring counters transport work service_limits
local_stop limit_table parameter_table parameter_values shared_state cycle_state rate_limit event_log
stop_frames shares chunk_store stand_in slot_pool timers peer_set connection peer_table latch_store
latched_values last_value_store page_texts names
policy_handover peer_rights
message_queue listed_numbers pair_table topic_rows topic_table own_type_structs own_type_schemas own_types
subscription_table call_table completion number_queue
submission_queue shared_inbox core_options
core_state topic_rates message_store check_sum peer_queues told_message outbox long_outbox subscription_queues
batch mask_keys partial_frames control_frames round_trip credit urgent_frames message_frames
frame_selection frame_group
sender refusals access_control parameters parameter_requests
local_delivery long_deliveries receiver frame_handler turns ingress json_fault
long_arrival member_list long_ingress
fragment_ingress
checked_text trackers message_parking direct_messages liveness call_goals
call_completion long_calls
publish_predictor audiences advertisement_table topic_places kept_ids subscriptions advertisements broker
topic_handles service_directory service_providers
stop_rules stop_gate stop_switch thread_stops stop_service
listed_topics topic_holders fitting_names statistics_report metrics_report topic_pages own_pages
statistics_feed parameters_feed clock_feed gone_names graph_record graph_message connection_graph
parameter_services graph_services type_services endpoint_services
call_requests call_router numbered told_numbers listings registrations revocation stop_state_feed
value_publisher long_publications handle_submissions thread_submissions pair_release handle_registry
request_router dispatcher
core_parts core_check core memory_plan service_loop
""".split()
_place = {name: place for place, name in enumerate(service_order)}


def _stem(path):
    return re.sub(r"\.\w+$", "", path.rpartition("/")[2])


def _included(t, path):
    """(line, name) of what a file of src/service includes of it."""
    for number, line in enumerate(t.lines(path), 1):
        named = re.match(r'\s*#\s*include\s+"service/(\w+)\.hpp"', line)
        if named and named[1] != _stem(path):
            yield number, named[1]


def files_include_what_stands_before_them(t):
    for path in t.within(["src/service"]):
        own = _stem(path)
        for number, name in _included(t, path):
            for one in (own, name):
                if one not in _place:
                    yield finding(path, number, "include-order", f"{one} has no place in service_order")
            if _place.get(name, -1) > _place.get(own, len(_place)):
                yield finding(path, number, "include-order", f"{name} stands above {own}")
    for name in service_order:
        if not any(t.exists(f"src/service/{name}{suffix}") for suffix in (".hpp", ".cpp")):
            yield finding("tests/tidy/inside.py", 1, "include-order", f"src/service has no {name}")


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


def parts_are_made_in_that_order(t):
    last = ""
    for number, name, file in _parts(t):
        if _place.get(file, -1) < _place.get(last, -1):
            yield finding(parts_header, number, "include-order", f"{name} stands before {last}")
        last = file


def parts_have_one_name(t):
    """A member that is a part, or refers to one, is called after its class, and so is what a part `needs`,
    but for the state."""
    parts = {name for _, name, file in _parts(t) if name not in _tables(t)}
    for path in t.within(["src/service"], (".hpp",)):
        needed = False
        for number, line in enumerate(t.code(path), 1):
            needed = (needed or line == "  struct needs {") and line != "  };"
            member = re.match(r"  (?:const )?(\w+)(?:&| ) ?(\w+)_;", line)
            need = re.match(r"    (?:const )?(?:class )?(\w+)& (\w+);", line) if needed else None
            if member and member[1] in parts and member[1] != member[2]:
                yield finding(path, number, "part-name", f"{member[2]}_: call it {member[1]}_")
            elif need and need[1] != "core_state" and need[1] != need[2]:
                yield finding(path, number, "part-name", f"{need[2]}: call it {need[1]}")


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


def _drawn(t):
    """The line of each word in the first block of text."""
    lines, fence = {}, 0
    for number, line in enumerate(t.lines(page), 1):
        fence += line.startswith("```")
        if fence == 1:
            lines.update((word, number) for word in re.findall(r"\w+", line))
    return lines


def the_page_shows_the_parts(t):
    drawn = _drawn(t)
    parts = list(_parts(t))
    told = [(number, re.match(r"\| `(\w+)` \|", line)) for number, line in _chapter(t, "The parts")]
    told = [(number, match[1]) for number, match in told if match]
    start = next((number for number, _ in _chapter(t, "The parts")), 1)
    names = [name for _, name, _ in parts]
    missing = [name for name in names if name not in drawn]
    if missing:
        yield finding(page, 1, "inside", f"the picture lacks {', '.join(missing)}")
    for (number, name), right in zip(told + [(start, "nothing more")], names + ["nothing more"]):
        if name != right:
            yield finding(page, number, "inside", f"{right} comes here in core_parts.hpp, not {name}")
            break
    class_in = {file: name for _, name, file in parts}
    for _, name, file in parts:
        for one in _included_parts(t, file, class_in):
            other = class_in[one]
            if drawn.get(other, len(t.lines(page))) <= drawn.get(name, 0):
                yield finding(page, drawn[name], "inside", f"{name} includes {other}, which is not below it")


def _included_parts(t, file, parts):
    """The parts that a part includes itself, or by a header that is none."""
    found, seen, left = set(), {file}, [file]
    while left:
        one = left.pop()
        for path in (f"src/service/{one}.hpp", f"src/service/{one}.cpp"):
            for _, name in _included(t, path) if path in t.paths else ():
                if name not in seen:
                    seen.add(name)
                    (found.add if name in parts else left.append)(name)
    return sorted(found)


def the_journeys_go_as_the_page_says(t):
    code = _program(t)
    above = []  # of each step around the next one: depth, file, function, and its calls that are left
    lines = list(_chapter(t, "The journeys"))
    if not lines:
        yield finding(page, 1, "inside", "there are no journeys")
    for number, line in lines:
        if line.startswith("#"):
            above = []
        step = re.match(r"( *)\d+\. ", line)
        if not step:
            continue
        named = re.match(r"`([\w/.]+): (\w+)`", line[step.end():])
        if not named:
            yield finding(page, number, "inside", "a step begins with `FILE: FUNCTION`")
            continue
        depth = len(step[1])
        path, function = named[1] if "/" in named[1] else "src/service/" + named[1], named[2]
        if path not in t.paths:
            yield finding(page, number, "inside", f"there is no {path}")
            continue
        if not code.unit(path).bodies(function, path):
            yield finding(page, number, "inside", f"{path} defines no {function}")
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
larger = {"core": 526, "ingress": 434, "request_router": 404, "long_ingress": 495, "outbox": 435,
          "publish_predictor": 401, "stop_rules": 560, "subscription_queues": 449}


def the_page_shows_the_transport(t):
    """Its picture has all files of TLS; a word in it with a `_` is a file of src/net."""
    of_tls = {_stem(path) for path in t.within(["src/net/tls"], (".hpp",))}
    of_net = {_stem(path) for path in t.within(["src/net"], (".hpp",))}
    named, block = {}, False
    for number, line in _chapter(t, "The transport"):
        block = block != line.startswith("```")
        named.update((word, number) for word in re.findall(r"\w+", line) if block or "`" in line)
    start = next((number for number, _ in _chapter(t, "The transport")), 1)
    missing = sorted(of_tls - set(named))
    if missing:
        yield finding(page, start, "inside", f"the transport's picture lacks {', '.join(missing)}")
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
    "topic_handles": {"needs": 9},
    "core": {"public": 27, "functions": 47},
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
    """(line, class, {what: how many}) of each class in the text of a header."""
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
        needs = re.search(r"struct needs \{([^}]*)\}", body)
        count["needs"] = len(re.findall(r"& (?!state;)\w+;", needs[1])) if needs else 0
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


rules = (files_include_what_stands_before_them, parts_are_made_in_that_order, parts_have_one_name,
         rows_have_typed_indices, limits_are_tied,
         the_stop_is_recognised_at_the_gate, the_page_shows_the_parts, the_page_shows_the_transport,
         the_journeys_go_as_the_page_says, parts_are_small, classes_are_small)
