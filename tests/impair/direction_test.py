# SPDX-License-Identifier: Apache-2.0
"""The arithmetic of the impairment, without a network: needs no privileges."""
import unittest

import direction

ms = 1_000_000


def line(*settings, seed="1"):
    one = direction.direction(seed)
    for setting in settings:
        one.settings.set(*setting.split("="))
    return one


def departures_of(one, packets=1000, apart=ms, size=100):
    return [one.take(n * apart, size) for n in range(packets)]


class settings(unittest.TestCase):
    def test_read_as_typed_and_shown_as_read(self):
        for text in ("delay=20ms", "delay=200us", "jitter=1500us", "loss=3%", "loss=0.5%", "rate=2000kbit",
                     "queue=1500", "black_hole=on", "reorder_by=1ms", "duplicate=100%"):
            self.assertEqual(str(line(text).settings), text)
        self.assertEqual(line("delay=1.5s").settings.delay, 1500 * ms)
        self.assertEqual(line("rate=2mbit").settings.rate, 250_000)
        self.assertEqual(line("queue=64KiB").settings.queue, 65536)
        self.assertEqual(str(line("loss=0%", "rate=none", "black_hole=off").settings), "perfect")

    def test_refused_with_what_was_wanted(self):
        for text, wanted in (("delay=20", "a time"), ("delay=-1ms", "a time"), ("loss=3", "a share"),
                             ("loss=101%", "100%"), ("rate=0mbit", "bits"), ("queue=x", "bytes"),
                             ("black_hole=1", "on or off"), ("speed=1", "there is no setting speed")):
            with self.assertRaisesRegex(ValueError, wanted):
                line(text)


class packets(unittest.TestCase):
    def test_pass_at_once_on_a_perfect_line(self):
        self.assertEqual(departures_of(line(), 100), [[n * ms] for n in range(100)])

    def test_take_the_delay(self):
        self.assertEqual(departures_of(line("delay=20ms"), 100), [[(n + 20) * ms] for n in range(100)])

    def test_one_seed_does_the_same_twice_and_another_does_not(self):
        bad = ("delay=20ms", "jitter=5ms", "loss=5%", "duplicate=5%", "reorder=5%")
        self.assertEqual(departures_of(line(*bad)), departures_of(line(*bad)))
        self.assertNotEqual(departures_of(line(*bad)), departures_of(line(*bad, seed="2")))

    def test_are_lost_in_the_share_that_was_asked_for(self):
        one = line("loss=3%")
        lost = departures_of(one, 100_000).count([])
        self.assertEqual(lost, one.counts.lost)
        self.assertAlmostEqual(lost / 100_000, 0.03, delta=0.003)  # 5 standard deviations
        self.assertEqual(departures_of(line("loss=100%")), [[]] * 1000)

    def test_are_lost_alike_whatever_else_happens(self):
        alone = [times == [] for times in departures_of(line("loss=10%"))]
        for other in ("delay=3ms", "jitter=2ms", "duplicate=50%", "reorder=50%"):
            self.assertEqual([times == [] for times in departures_of(line("loss=10%", other))], alone)
        more = [times == [] for times in departures_of(line("loss=20%"))]
        self.assertTrue(all(m for a, m in zip(alone, more) if a))  # those, and others

    def test_stay_in_order_under_jitter_and_within_it(self):
        left = [when for (when,) in departures_of(line("delay=10ms", "jitter=8ms"))]
        self.assertEqual(left, sorted(left))
        late = [when - n * ms for n, when in enumerate(left)]
        self.assertTrue(all(2 * ms <= one <= 18 * ms for one in late))
        self.assertGreater(max(late) - min(late), 8 * ms)

    def test_never_leave_before_they_came(self):
        left = enumerate(departures_of(line("delay=1ms", "jitter=5ms")))
        self.assertTrue(all(when >= n * ms for n, (when,) in left))

    def test_are_overtaken_when_they_are_reordered_and_delay_no_others(self):
        one = line("delay=10ms", "reorder=10%", "reorder_by=5ms")
        late = [when - n * ms for n, (when,) in enumerate(departures_of(one))]
        self.assertEqual(sum(each != 10 * ms for each in late), one.counts.reordered)
        self.assertTrue(50 < one.counts.reordered < 150)
        self.assertTrue(all(10 * ms <= each <= 15 * ms for each in late))

    def test_arrive_twice_when_they_are_duplicated(self):
        one = line("duplicate=10%")
        twice = [departures for departures in departures_of(one) if len(departures) == 2]
        self.assertEqual(len(twice), one.counts.duplicated)
        self.assertTrue(50 < len(twice) < 150)
        self.assertTrue(all(first == second for first, second in twice))

    def test_wait_for_each_other_before_a_rate_limit(self):
        one = line("rate=800kbit", "delay=1ms")  # 1000 bytes: 10 ms
        self.assertEqual([one.take(0, 1000) for _ in range(3)], [[11 * ms], [21 * ms], [31 * ms]])
        self.assertEqual(one.take(100 * ms, 1000), [111 * ms])  # the line was free

    def test_are_lost_when_the_queue_before_the_rate_limit_is_full(self):
        one = line("rate=800kbit", "queue=3000")
        departures = [one.take(0, 1000) for _ in range(10)]
        self.assertEqual([len(each) for each in departures], [1, 1, 1, 1, 0, 0, 0, 0, 0, 0])
        self.assertEqual(one.counts.overflowed, 6)

    def test_vanish_in_a_black_hole_and_it_changes_nothing_for_later_packets(self):
        one, other = line("loss=10%"), line("loss=10%")
        before = departures_of(other, 300)
        departures_of(one, 100)
        one.settings.set("black_hole", "on")
        self.assertEqual(departures_of(one, 100), [[]] * 100)
        one.settings.set("black_hole", "off")
        behind = [one.take(n * ms, 100) for n in range(200, 300)]
        self.assertEqual(behind, before[200:])
        self.assertEqual((one.counts.packets, one.counts.swallowed), (300, 100))


if __name__ == "__main__":
    unittest.main()
