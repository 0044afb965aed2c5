# SPDX-License-Identifier: Apache-2.0
"""Tests the tidy test: offences are planted in a copy of the tree, some in place of a file that is right, and
each must be found where it is; what only looks like one must not be."""
import os
import shutil
import tempfile
import unittest
import unittest.mock

import tidy
from tree import strip, tree

top = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
spdx = "// SPDX-License-Identifier: Apache-2.0\n"
hash_spdx = "# SPDX-License-Identifier: Apache-2.0\n"

# (file, text, [(line, rule)]): a file to add and all that is wrong with it. Line 1 is the licence.
plants = [
    ("src/service/base/plant_a.cpp",
     spdx + "lws_context* c;\n// as libwebsockets has it\nsimdjson::dom::parser p;\n",
     [(2, "library-room"), (3, "library-room"), (4, "library-room")]),
    ("src/net/base/plant_b.cpp",
     spdx + "#include <simdjson.h>\n#include <concurrentqueue/concurrentqueue.h>\n",
     [(2, "library-room"), (3, "library-room")]),
    ("src/wire/text/plant_c.cpp", spdx + "#include <dragonbox/dragonbox.h>\n", [(2, "library-room")]),
    ("src/service/base/plant_d.cpp", spdx + "moodycamel::ConcurrentQueue<int> q;\n", [(2, "library-room")]),
    ("tools/plant_e.cpp", spdx + "lws_context* c;\n", [(2, "library-room")]),
    ("tools/rowe/setup/plant_f.cpp", spdx + "#include <openssl/evp.h>\n#include <qrencode.h>\n",
     [(2, "library-room"), (3, "library-room")]),
    ("tools/rowe/setup/certificate_plant.cpp", spdx + "#include <openssl/evp.h>\n", []),
    ("docs/examples/plant_e.cpp", spdx + "#include <openssl/evp.h>\n",
     [(1, "unlinked-example"), (2, "library-room"), (2, "interface")]),

    ("src/wire/text/plant_f.cpp",
     spdx + '#include "service/core/core.hpp"\n#include "net/base/address.hpp"\n',
     [(2, "arrow"), (3, "arrow")]),
    ("src/service/base/plant_g.cpp", spdx + '#include "net/base/address.hpp"\n#include "page/page.hpp"\n',
     [(2, "arrow"), (3, "arrow")]),
    ("src/json/text/plant_h.cpp", spdx + '#include "wire/text/utf8.hpp"\n', [(2, "arrow")]),
    ("src/net/base/plant_i.cpp", spdx + '#include "service/core/core.hpp"\n#include "api/url.hpp"\n',
     [(2, "arrow"), (3, "arrow")]),

    ("tools/plant_j.cpp",
     spdx + '#include "service/core/core.hpp"\n#include <boost/any.hpp>\n#include "../src/api/url.hpp"\n',
     [(2, "interface"), (3, "interface"), (4, "interface")]),
    ("docs/examples/plant_k.cpp", spdx + "#include <fmt/core.h>\n",
     [(1, "unlinked-example"), (2, "interface")]),
    ("include/rowe/plant_l.hpp", spdx + "#include <pthread.h>\n#include \"wire/utf8.hpp\"\n",
     [(2, "interface"), (3, "interface")]),
    ("rt/src/plant_m.cpp", spdx + "#include <rowe/result.hpp>\n", [(2, "interface")]),
    ("include/rowe/plant_m.h",
     spdx + "#include <stdint.h>\n#include <cstdint>\n#include <stdio.h>\n#include <rowe/result.hpp>\n",
     [(3, "interface"), (4, "interface"), (5, "interface")]),
    ("docs/examples/plant_m.c", spdx + "#include <stdio.h>\n#include <rowe/rowe.h>\n#include <string>\n",
     [(1, "unlinked-example"), (4, "interface")]),

    ("rt/src/plant_n.cpp",
     spdx + "std::atomic_thread_fence(std::memory_order_seq_cst);\nvolatile int flag;\n",
     [(2, "banned-word"), (3, "banned-word")]),
    ("src/api/plant_o.cpp",
     spdx + '#include <iostream>\nstd::printf("x");\nstd::abort();\nstd::cerr << 1;\nexit(1);\n',
     [(line, "no-output-no-abort") for line in range(2, 7)]),
    ("src/service/base/plant_p.cpp",
     spdx + "clock_gettime(CLOCK_MONOTONIC, &t);\nstd::chrono::steady_clock::now();\nrand();\n"
     "std::random_device r;\nstd::this_thread::get_id();\nrt::monotonic_clock::now();\n",
     [(line, "core-is-a-function") for line in range(2, 8)]),
    ("src/service/base/plant_5.cpp",
     spdx + '#include "wire/rosbridge/rosbridge.hpp"\n#include "wire/foxglove/foxglove_codec.hpp"\n'
     'wire::plain::decode(text);\nif (by == websocket_profile::standard) return;\n'
     'if (subprotocol == "foxglove.sdk.v1") return;\n'
     '// as Hop has it\nbool is_plain = codec == hop_;\ninto.member("plain", x); // of rosbridge_suite\n',
     [(line, "codec") for line in (2, 3, 4, 5, 6, 7, 8, 8, 9)]),
    ("src/wire/text/plant_q.cpp", spdx + "std::chrono::system_clock::now();\n", [(2, "core-is-a-function")]),
    ("tests/rt/plant_r.cpp", spdx + "std::this_thread::sleep_for(1ms);\nusleep(5);\n",
     [(2, "no-sleep-in-tests"), (3, "no-sleep-in-tests")]),
    ("tests/tools/plant_s.py", hash_spdx + "time.sleep(1)\n", [(2, "no-sleep-in-tests")]),
    ("tests/json/plant_of_tests_test.cpp", spdx + "TEST(a, b) {}\n", [(1, "unlisted-test")]),
    ("src/api/plant_t.cpp", spdx + "try {\n} catch (...) {\n}\n", [(3, "catch-all")]),
    ("src/api/plant_u.cpp",
     spdx + "x.load(std::memory_order_acquire);\ny.store(1, std::memory_order_release);  // counted\n\n\n\n\n"
     "// of the words in the lane\nz.load(std::memory_order::relaxed);\n",
     [(2, "order"), (3, "order"), (9, "order")]),
    ("src/api/plant_9.cpp",
     spdx + "x.load(std::memory_order_acquire);  // acquire: pairs with the release in nowhere()\n",
     [(2, "order")]),
    ("src/service/base/service_limits.hpp",
     spdx + "// Folder base: limits. No peers.\n#pragma once\nstatic_assert(1 < 2);\nint last = no_index;\n",
     [(1, "limits"), (5, "no-index")]),
    ("tests/model/plant_6.hpp",
     spdx + "atomics::variable<pair_phase> phase;\nstd::atomic< detail::audience > heard;\n",
     [(2, "pair-word"), (3, "pair-word")]),

    ("src/api/plant_v.cpp", "int x;\n", [(1, "spdx")]),
    ("tools/plant_w", "#!/bin/bash\necho\n", [(1, "spdx")]),
    ("tests/rt/plant_x.cpp", spdx + "// " + "x" * 108 + "\n", [(2, "columns")]),
    ("rt/include/rowe/rt/plant_x.hpp", spdx + "int x;\n" * 400, [(1, "length")]),
    ("tests/rt/plant_y.cpp", spdx + "int\tx;\nint y; \r\nint z; \nint last;",
     [(2, "white-space"), (3, "white-space"), (4, "white-space"), (5, "white-space")]),
    ("docs/plant_z.md", "later: TO" "DO\nFIX" "ME\nsee /wo" "rk/x and /ro" "ot/.bashrc\n",
     [(1, "left-open"), (2, "left-open"), (3, "machine")]),
    ("docs/plant_1.md",
     "# One heading\n[gone](nowhere.md) [there](plant_1.md#one-heading)\n[gone](#no-heading)\n"
     "Read `src/net/nowhere.hpp` and `include/rowe/{result,nowhere}.hpp`.\n",
     [(2, "link"), (3, "link"), (4, "named-file"), (4, "named-file")]),
    ("docs/plant_4.md", "```cpp\nint main() {\n  rowe::nothing_of_the_kind();\n}\n```\n", [(3, "example")]),
    ("docs/plant_5.md", "```cmake\ninclude(FetchContent)\nfind_package(nothing)\n```\n", [(3, "example")]),
    ("tests/rt/plant_2.cpp", spdx + "// as tests/rt/nowhere_test.cpp shows\n", [(2, "named-file")]),
    ("bench/plant_3.cmake", hash_spdx + "# see docs/nowhere.md\n", [(2, "named-file")]),
    ("docs/plant_6.md", "Letters go by the front door.\nA carrier and a `dialect`, or dialects.\n",
     [(1, "word"), (1, "word"), (2, "word"), (2, "word")]),
    ("src/service/outgoing/mask_keys.cpp",
     spdx + '#include "service/base/ids.hpp"\n#include "service/incoming/ingress.hpp"\n', [(3, "folder")]),
    ("src/service/plant_8.cpp", spdx, [(1, "folder")]),
    ("src/wire/http/plant_8.cpp", spdx + '#include "wire/codec/codec.hpp"\n', [(2, "folder")]),
    ("src/service/stop/zz_plant.hpp", spdx + "// Folder stop: a. B.\n#pragma once\n", [(2, "folder")]),
    ("src/service/outgoing/batch.cpp",
     spdx + "bool of = stop_gate::find(read, asked, text) == stop_verb::stop;\n",
     [(2, "stop-gate")]),
    ("src/service/base/plant_9.cpp", spdx + "int x;\n" * 400, [(1, "length"), (1, "size")]),
    ("src/service/outgoing/batch.hpp",
     spdx + "struct batch_needs {\n  core_state& state_;\n" + "".join(f"  outbox& p{n}_;\n" for n in range(9))
     + "};\nclass batch : batch_needs {\n public:\n"
     + "  explicit batch(const batch_needs& parts) : a_{1}, b_{2} {}\n"
     + "".join(f"  int f{n}() {{ return {n}; }}\n" for n in range(25)) + " private:\n"
     + "".join(f"  int m{n}_ = 0;\n" for n in range(6)) + "};\n",
     [*((line, "part-name") for line in range(4, 13)), (14, "size"), (14, "size"), (14, "size")]),
    ("src/service/core/core_parts.hpp",
     spdx + "class core_parts {\n  core_state state_;\n  topic_rates topic_rates_;\n  outbox outbox_;\n"
     "  message_store message_store_;\n  sender writer_;\n  stop_service stop_service_;\n"
     "  handle_registry handle_registry_;\n};\n",
     [(5, "part-order"), (7, "part-name")]),
    ("docs/inside.md",
     "# Inside\n```\n  core           x\n  requests       y\n```\n"
     "## base\n| `event_log` | a | b |\n## state\n"
     "## Four journeys\n### One\n"
     "1. `core/core.cpp: cycle` begins.\n"
     "   1. `handles/handle_registry.cpp: scan` is called, and calls\n"
     "      1. `handles/handle_submissions.cpp: take`, which calls\n"
     "         1. `topics/value_publisher.hpp: publish`, and not\n"
     "         2. `outgoing/subscription_queues.cpp: fan_out`.\n"
     "   2. `stop/stop_service.hpp: update` comes earlier.\n"
     "2. `topics/broker.cpp: nothing_of_the_kind` is not there,\n"
     "3. `include/rowe/detail/nowhere.hpp: publish` neither.\n"
     "4. `core/core.cpp` has no function here.\n"
     "5. `topics/broker.cpp: relay` is no beginning.\n"
     + "".join(f"{n}. `core/core.cpp: cycle` goes on.\n" for n in range(6, 9))
     + "## The transport\n```\nsession context\nlws_nothing\n```\n",
     [(18, "named-file"),
      *((line, "inside") for line in (1, 4, 7, 8, 8, 10, 15, 16, 17, 18, 19, 20, 24, 27))]),
    ("tests/sim/plant_7.cpp", spdx + "int weather_of_today;\nauto roll = DICE;\nint x; // it naps\n",
     [(2, "word"), (3, "word"), (4, "word")]),
    ("src/service/base/plant_7.cpp",
     spdx + "slots.unkeep(dead);  // owes much, and put aside\n"
     "state.to_peers.tell_room(); // what it rings, once drawn\n",
     [(2, "word")] * 4 + [(3, "word")] * 4),
    ("src/net/base/plant_7.cpp",
     spdx + "guest& one = parting_.first;\nhttp_refusal why{sentence, room_bytes_};\nvoid on_refused();\n",
     [(2, "word"), (2, "word"), (3, "word"), (3, "word"), (3, "word"), (4, "word")]),
    ("src/api/plant_7.cpp", spdx + "stops.hand_in(all); // may_begin_all_the_same, lives_no_longer\n",
     [(2, "word"), (2, "word"), (2, "word")]),
    ("tools/plant_7.cpp", spdx + "++complaints_; // to be mended\nqueues.told_full = decode_room;\n",
     [(2, "word"), (2, "word"), (3, "word")]),
    ("tests/sim/plant_8.cpp", spdx
     + "// for want of a mend\nlanes_max(teller);\nfor (auto& near_peer : peers) write();\n",
     [(2, "word"), (3, "word"), (3, "word"), (4, "word")]),
]

# What comes close and is right.
innocent = [
    ("src/net/base/innocent_a.cpp",
     spdx + '#include "service/base/transport.hpp"\n#include "wire/text/utf8.hpp"\nlws_context* c;\n'),
    ("src/service/threads/number_queue_innocent.cpp",
     spdx + "#include <concurrentqueue/concurrentqueue.h>\n"),
    ("src/service/calls/innocent_a.cpp",
     spdx + '#include "wire/codec/codec.hpp"\n.messages_unasked = options.plain_unasked,\n'
     'into.member("plain", x);\n'
     "const codec& in = protocols_.of(asked.codec); // barely, or by hops\n"),
    ("src/service/calls/innocent_b.cpp",
     spdx + '// rand() and steady_clock would be wrong.\nconst char* word = "volatile, rand(), TIMEOUT";\n'
     "std::snprintf(room, 8, format);\nauto strand(int);\nint brand(int);\n"),
    ("src/api/innocent_c.cpp",
     spdx + "x.load(std::memory_order_acquire);  // pairs with the release in stop()\n"
     "// relaxed, both: the two counters are advice, and nothing\n// is read because of them\n"
     "a.load(std::memory_order_relaxed);\nb.load(std::memory_order_relaxed);\n"
     "c.load(std::memory_order_seq_cst);\n"),
    ("tools/innocent_d.cpp",
     spdx + "#include <sys/socket.h>\n#include <rowe/rowe.hpp>\nstd::printf(\"x\");\n"),
    ("tests/bench_innocent_e.cpp", spdx + "#include <simdjson.h>\n// " + "http://x.example/" + "x" * 120 + "\n"),
    ("tests/service/innocent_h.cpp", spdx + "audience_word<atomics> audience;\nstd::span<audience> all;\n"),
    ("tests/sim/innocent_h.cpp", spdx + "rt::producer_epoch<> epoch; // europe, a snapshot, a doorbell\n"),
    ("tools/innocent_i.cpp", spdx + "// a letter of the alphabet, drawn by a guest, and a sentence\n"),
    ("src/wire/text/innocent_i.cpp",
     spdx + "// it recommends what has headroom_bytes; a withdrawn deadline\nint tailroom_bytes;\n"),
    ("src/net/base/innocent_j.cpp", spdx + "int x;\n" * 399),
    ("tests/net/innocent_j.cpp", spdx + "int x;\n" * 400),
    ("tests/innocent_f.cpp", spdx + "// clang-format off\n// " + "x" * 120 + "\n// clang-format on\n"),
    ("docs/innocent_g.md",
     "`tests/ROOM/CMakeLists.txt`, `src/*/*.cpp`, `include/rowe/{result,event}.hpp`, and/or\n"
     "```cpp\n#include <rowe/rowe.hpp>\n\nint main() {\n}\n```\n[out](https://example.org/x) `[no](link.md)`\n```\n[no](link.md)\n```\n"
     "```cmake\ninclude(FetchContent)\nFetchContent_MakeAvailable(rowe)\n```\n"),
]


class tidy_test(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.root = os.path.join(folder, "copy")
        skip = shutil.ignore_patterns(".git", "build", "build-*", "node_modules", "__pycache__")
        shutil.copytree(top, cls.root, ignore=skip, symlinks=True)
        before = set(tidy.without_exempt(tidy.found_by_rules(cls.root)))
        for path, text, *_ in plants + innocent:
            where = os.path.join(cls.root, path)
            os.makedirs(os.path.dirname(where), exist_ok=True)
            with open(where, "w", newline="") as file:
                file.write(text)
        cls.found_by_rules = tidy.found_by_rules(cls.root)
        new = set(tidy.without_exempt(cls.found_by_rules)) - before
        cls.found = sorted((one.path, one.line, one.rule) for one in new)

    def found_in(self, path):
        return [(line, rule) for where, line, rule in self.found if where == path]

    def test_each_planted_offence_is_found_where_it_is_and_nothing_else(self):
        for path, _, offences in plants:
            with self.subTest(path):
                self.assertEqual(self.found_in(path), sorted(offences))

    def test_what_only_looks_like_an_offence_is_not_one(self):
        for path, _ in innocent:
            with self.subTest(path):
                self.assertEqual(self.found_in(path), [])

    def test_planting_in_one_place_is_not_found_in_another(self):
        planted = {path for path, *_ in plants}
        self.assertEqual([one for one in self.found if one[0] not in planted], [])

    def test_every_rule_has_a_plant(self):
        planted = {path for path, *_ in plants}
        for rule, found in zip(tidy.rules, self.found_by_rules):
            with self.subTest(rule.__name__):
                self.assertTrue(any(one.path in planted for one in found))

    def test_an_exemption_that_excuses_nothing_is_found(self):
        stale = {("src/api/endpoint.cpp", "catch-all"): "it used to"}
        with unittest.mock.patch.dict(tidy.exempt, stale):
            found = [(one.path, one.rule) for one in tidy.without_exempt(self.found_by_rules)]
        self.assertIn(("src/api/endpoint.cpp", "exempt"), found)

    def test_a_file_that_is_listed_as_longer_may_only_shrink(self):
        path = "rt/include/rowe/rt/plant_x.hpp"
        for lines, whose in ((401, []), (402, []), (400, [path])):
            with unittest.mock.patch.dict(tidy.longer, {path: (lines, "it is planted")}):
                found = [one.path for one in tidy.files_are_short(tree(self.root))]
            self.assertEqual(sorted({*found} - {"src/service/base/plant_9.cpp"}), whose)
        with unittest.mock.patch.dict(tidy.longer, {"src/api/endpoint.cpp": (500, "it used to be")}):
            found = [one.what for one in tidy.files_are_short(tree(self.root))]
        self.assertIn("src/api/endpoint.cpp is no longer longer", found)

    def test_a_name_that_is_given_nowhere_any_more_is_found(self):
        with unittest.mock.patch.object(tidy, "named_elsewhere", (*tidy.named_elsewhere, "old_rope")):
            found = [one.what for one in tidy.words_are_the_fields(tree(self.root))]
        self.assertIn("nothing is called old_rope any more", found)

    def test_an_exemption_excuses_its_own_file_and_rule_only(self):
        path, _, offences = plants[0]
        with unittest.mock.patch.dict(tidy.exempt, {(path, "catch-all"): "another rule"}):
            found = [one for one in tidy.without_exempt(self.found_by_rules)
                     if (one.path, one.rule) == (path, "library-room")]
        self.assertEqual(len(found), len(offences))


class stripping(unittest.TestCase):
    def test_blanks_comments_and_literals_and_keeps_lines(self):
        self.assertEqual(strip('a; // b\n/* c\nd */ e; "f // g" h;\n'), 'a; \n\n e; "" h;\n')
        self.assertEqual(strip("1'000'000; 'x'; '\\''; '\"';"), "1'000'000; ' '; ' '; ' ';")
        self.assertEqual(strip('R"(a " // b)" c; R"x(\n)")x" d'), '"" c; ""\n d')


if __name__ == "__main__":
    unittest.main()
