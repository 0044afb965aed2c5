# SPDX-License-Identifier: Apache-2.0
"""JSON through `rowe serve`: what one peer publishes reaches another as it was, or not at all."""
import decimal
import json
import unittest

import documents
import programs
from documents import PLAIN, INVALID, NOT_UTF8, VALID
from frames import TEXT, frame
from programs import unlimited


def meaning(text):
    """What a JSON text says, by Python's reader: numbers in full, names in their order, twice if twice."""
    def refuse(word):
        raise ValueError(word)

    return json.loads(text, parse_int=decimal.Decimal, parse_float=lambda digits: repr(float(digits)),
                      parse_constant=refuse, object_pairs_hook=lambda pairs: ("object", pairs))


class relay:
    """A hub, one who publishes, one who has subscribed."""

    def __init__(self, serving):
        self.serving, self.rounds, self.fences = serving, 0, 0
        self.publisher = serving.connect()
        self.subscriber = serving.connect()
        self.subscriber.send(frame(TEXT, b'{"op":"subscribe","topic":"/t"}'))
        self.answers(self.subscriber)
        self.answers(self.publisher)  # from here on it is answered by this codec

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.publisher.socket.close()
        self.subscriber.socket.close()

    def answers(self, s):
        """What it says up to a refusal that is ours: answers come in the order of what was asked."""
        self.fences += 1
        mine = f"fence {self.fences}"
        s.send(frame(TEXT, json.dumps({"op": "unsubscribe", "topic": "/never", "id": mine}).encode()))
        said = []
        while True:
            opcode, payload = s.message()
            assert opcode == TEXT
            if json.loads(payload).get("id") == mine:
                return said
            said.append(payload)

    def delivered(self):
        """The body of the next message that reaches the subscriber."""
        opcode, payload = self.subscriber.message()
        assert opcode == TEXT
        return dict(meaning(payload.decode())[1])["msg"]

    def is_accepted(self, test, text):
        self.publisher.send(frame(TEXT, text))
        test.assertEqual(self.answers(self.publisher), [], "it is accepted without a word")

    def passes(self, test, text):
        """The text is accepted, and arrives."""
        self.is_accepted(test, text)
        test.assertEqual(self.delivered(), dict(meaning(text.decode())[1])["msg"])

    def is_refused(self, test, text):
        """The text is answered with an error, a status or one of the plain codec, and nothing arrives."""
        self.publisher.send(frame(TEXT, text))
        said = self.answers(self.publisher)
        test.assertEqual(len(said), 1)
        answer = json.loads(said[0])
        if "error" in answer:
            test.assertTrue(answer["error"]["code"] and answer["error"]["text"])
        else:
            test.assertEqual((answer["op"], answer["level"]), ("status", "error"))
            test.assertTrue(answer["msg"])
        self.nothing_arrived(test)

    def is_for_nobody(self, test, text):
        """The text is accepted, and is no message of the topic."""
        self.is_accepted(test, text)
        self.nothing_arrived(test)

    def is_cut(self, test, text):
        """The text ends its connection with 1007, and nothing arrives."""
        self.publisher.send(frame(TEXT, text))
        test.assertEqual(self.publisher.until_close()[:2], ([], 1007))
        self.publisher.socket.close()
        self.publisher = self.serving.connect()
        self.nothing_arrived(test)

    def nothing_arrived(self, test):
        self.rounds += 1
        self.passes(test, b'{"op":"publish","topic":"/t","msg":{"round":%d}}' % self.rounds)

    def does(self, test, verdict, text):
        """What is to become of a text of documents.py."""
        {VALID: self.passes, INVALID: self.is_refused, NOT_UTF8: self.is_cut,
         PLAIN: self.is_for_nobody}[verdict](test, text)


class values(unittest.TestCase):
    def test_each_as_a_member_of_a_message(self):
        outside = 2  # the message, and its body
        counts = dict.fromkeys((VALID, INVALID, NOT_UTF8), 0)
        with programs.server("hub", *unlimited) as serving, relay(serving) as through:
            for verdict, text in documents.values(outside):
                with self.subTest(f"{verdict}: {text[:60]!r} ({len(text)} bytes)"):
                    counts[verdict] += 1
                    whole = b'{"op":"publish","topic":"/t","msg":{"n":%d,"v":%b}}' % (sum(counts.values()),
                    text)
                    through.does(self, verdict, whole)
        print(f"JSON values: {counts}", flush=True)


class messages(unittest.TestCase):
    publish = {"op": "publish", "id": "i", "topic": "/t", "msg": {"a": [1, "x", None]}}

    def test_each_as_a_whole_text(self):
        counts = dict.fromkeys((VALID, INVALID, PLAIN), 0)
        with programs.server("hub", *unlimited) as serving, relay(serving) as through:
            for verdict, text in documents.messages(self.publish):
                with self.subTest(f"{verdict}: {text[:100]!r} ({len(text)} bytes)"):
                    counts[verdict] += 1
                    through.does(self, verdict, text)
        print(f"JSON messages: {counts}", flush=True)

    def test_a_text_ends_where_its_message_does(self):
        """Two texts in one read, or one in many fragments: neither lends the other a byte."""
        good = b'{"op":"publish","topic":"/t","msg":{"n":1}}'
        bad = b'{"op":"publish","topic":"/t","msg":{"n":1'
        body = ("object", [("n", decimal.Decimal(1))])
        with programs.server("hub", *unlimited) as serving, relay(serving) as through:
            for first, second in ((bad, b"}}"), (good, bad), (bad, good), (good, b""), (b"", good)):
                with self.subTest(first + b" | " + second):
                    through.publisher.send(frame(TEXT, first), frame(TEXT, second))
                    refused = [text for text in (first, second) if text != good]
                    self.assertEqual(len(through.answers(through.publisher)), len(refused))
                    for _ in range(2 - len(refused)):
                        self.assertEqual(through.delivered(), body)
                    through.nothing_arrived(self)


class table(unittest.TestCase):
    """The table itself, by Python's reader: what it calls valid is, and what it calls invalid is not, but for
    what Python lets pass and rowe refuses by choice."""

    def test_python_agrees(self):
        lets_pass = 0
        for verdict, text in documents.values(2):
            with self.subTest(f"{verdict}: {text[:60]!r}"):
                try:
                    read = meaning(text.decode())
                    good = read is not None or text == b"null"
                except (ValueError, RecursionError):
                    good = False
                if verdict == VALID:
                    self.assertTrue(good)
                elif good:
                    lets_pass += 1
                    self.assertTrue(self.by_choice(text, read), "Python takes it for valid")
        self.assertLess(lets_pass, 60)

    def by_choice(self, text, read):
        half_a_pair = b"\\ud" in text.lower()
        beyond_a_double = "inf" in repr(read) or (isinstance(read, decimal.Decimal) and float(read) in (
            float("inf"), -float("inf")))
        too_deep = text.count(b"[") + text.count(b"{") > documents.depth_max - 2
        return half_a_pair or beyond_a_double or too_deep


if __name__ == "__main__":
    unittest.main()
