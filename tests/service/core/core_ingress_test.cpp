// SPDX-License-Identifier: Apache-2.0
// In which order peers are heard: one message of each in turn, a bounded amount in one cycle, and a stop
// before all of it.
#include "core_fixtures.hpp"

#include <rowe/lane.hpp>
#include <rowe/stop_latch.hpp>

#include <algorithm>
#include <memory>
#include <optional>
#include <ranges>

namespace core_ingress_test {
namespace {

using namespace harness;

constexpr const char* stop_call = R"({"op":"call_service","id":"1","service":"/rowe/stop"})";

rowe::endpoint_options roomy() {
  return with_limits(small_options(), &limits::handle_bytes, 8 * 1024 * 1024);
}

struct core_ingress : core_test {
  core_ingress() : core_test{roomy()} {
    for (int i = 0; i < 4; ++i)
      peers.push_back(
          std::make_unique<peer>(on, rowe::service::side::server, "127.0.0.1:" + std::to_string(i)));
    // As sockets are read when several have something to say.
    for (const auto& p : peers)
      on.net.link_of(p->id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_in_turn;
    on.cycle();
  }

  // Hears who said what, by one character each, in the order in which it was carried out.
  std::string order() {
    std::string seen;
    while (const auto text = take(*heard)) seen += text->substr(9, 1);
    return seen;
  }
  void listen() {
    heard = &on.offer(rowe::detail::pair_kind::subscribe_text, "/heard", 8000, {.depth = 512});
    on.cycle();
  }
  void forget() {
    heard->lifecycle.close();
    on.cycle();
  }
  rowe::stop_latch opened_latch() { return on.open<rowe::stop_latch>(rowe::detail::latch_request({})); }
  // Each of these peers says so many messages.
  void flood(std::initializer_list<std::size_t> by, int count, std::size_t bytes = 0) {
    for (const std::size_t who : by)
      for (int i = 0; i < count; ++i) peers[who]->say(say(static_cast<char>('a' + who), bytes));
  }
  // As a client masks it, with a key of zeros.
  static std::vector<std::byte> frame_of(rowe::wire::opcode what, bool final, std::string_view payload) {
    std::vector<std::byte> frame(rowe::wire::frame_header_bytes_max + payload.size());
    const std::size_t header =
        rowe::wire::write_frame_header(frame.data(), what, payload.size(), rowe::wire::mask_key{});
    if (!final) frame[0] &= std::byte{0x7f};
    payload.copy(reinterpret_cast<char*>(frame.data() + header), payload.size());
    frame.resize(header + payload.size());
    return frame;
  }
  static std::string say(char who, std::size_t bytes = 0) {
    return R"({"op":"publish","topic":"/heard","msg":{"data":")" + std::string(1, who) +
           std::string(bytes, '.') + "\"}}";
  }

  std::vector<std::unique_ptr<peer>> peers;
  rowe::detail::queue_pair* heard = nullptr;
};

TEST_F(core_ingress, does_a_bounded_amount_in_one_cycle_and_wants_the_next_at_once) {
  listen();
  flood({0, 1, 2}, 50);
  on.cycle();
  EXPECT_EQ(order().size(), 100U);
  EXPECT_EQ(on.next_wake, on.now);
  on.cycles(2, 0ms);
  EXPECT_EQ(order().size(), 50U);
  EXPECT_GT(on.next_wake, on.now);
}

TEST_F(core_ingress, counts_the_size_of_messages_as_work) {
  listen();
  flood({0, 1, 2, 3}, 40, 3000);
  int cycles = 0;
  for (std::size_t all = 0; all < 160 && cycles < 100; ++cycles) {
    on.cycle();
    const std::size_t now = order().size();
    EXPECT_LE(now, 26U + 1U);
    all += now;
  }
  EXPECT_LT(cycles, 100);
}

TEST_F(core_ingress, reads_no_more_of_a_peer_before_it_has_heard_what_it_read) {
  listen();
  flood({0}, 2000);
  for (std::size_t all = 0; all < 2000;) {
    on.cycle();
    const std::size_t now = order().size();
    ASSERT_GT(now, 0U);
    all += now;
  }
}

TEST_F(core_ingress, carries_out_a_stop_before_everything_that_was_read_with_it) {
  listen();
  const auto latch = opened_latch();
  for (const char* text : {stop_call, R"({"service":"/rowe/stop","message_id":1})",
                           R"({"op":"publish","topic":"\/rowe\/stop","msg":{}})"}) {
    const auto before = on.count(counter::stops);
    flood({0, 1, 2}, 100, 20);
    peers[3]->say(text);
    on.cycle();
    EXPECT_EQ(on.count(counter::stops), before + 1) << text;
    EXPECT_LE(order().size(), 101U);
    for (int i = 0; i < 4; ++i) on.cycle();
    (void)order();
  }
}

TEST_F(core_ingress, finds_a_stop_behind_other_messages_of_its_own_peer) {
  listen();
  const auto latch = opened_latch();
  flood({0}, 10);
  peers[0]->say(stop_call);
  for (int i = 0; i < 10; ++i) peers[0]->say(say('b'));
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
  EXPECT_EQ(order(), "aaaaaaaaaabbbbbbbbbb");
}

// What a peer sends in front of a stop goes on waiting for its turn.
TEST_F(core_ingress, carries_out_nothing_but_the_stop_before_its_turn) {
  listen();
  const auto latch = opened_latch();
  flood({0}, 40);
  peers[0]->say(stop_call);
  peers[0]->say(stop_call);
  flood({1, 2, 3}, 40);
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 2U);
  EXPECT_EQ(order().substr(0, 40), "abcdabcdabcdabcdabcdabcdabcdabcdabcdabcd");
  on.cycles(60);
  EXPECT_EQ(order().size(), 60U);
  EXPECT_EQ(on.count(counter::stops), 2U);
  EXPECT_EQ(peers[0]->hear().size(), 2U);
}

// Only a whole scan finds that its text is valid.
TEST_F(core_ingress, carries_out_a_stop_with_a_number_of_hundreds_of_digits_in_its_turn) {
  listen();
  const auto latch = opened_latch();
  flood({0, 1, 2}, 60);
  peers[2]->say(R"({"service":"/rowe/stop","message_id":)" + std::string(250, '1') + "}");
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 0U);
  on.cycles(5);
  EXPECT_EQ(on.count(counter::stops), 1U);
}

TEST_F(core_ingress, lets_nobody_pass_by_the_words_of_a_stop) {
  const auto latch = opened_latch();
  for (const std::string text :
       {R"({"op":"publish","topic":"/heard","msg":{"data":"a","service":"/rowe/stop"}})",
        R"({"op":"publish","topic":"/heard","msg":{"data":"a","\"service\":\"/rowe/stop\"":1}})",
        R"({"op":"publish","msg":{"data":"a","x":[{"topic":"/rowe/stop"}]},"topic":"/heard"})",
        R"({"op":"publish","topic":"/heard","msg":{"data":"a","x":"\",\"service\":\"/rowe/stop"}})"}) {
    listen();
    for (int i = 0; i < 40; ++i) peers[0]->say(text);
    flood({1, 2, 3}, 10);
    on.cycle();
    const std::string seen = order();
    EXPECT_EQ(std::count(seen.begin(), seen.begin() + 13, 'b'), 3) << text << seen;
    on.cycles(3);
    forget();
  }
  EXPECT_EQ(on.count(counter::stops), 0U);
}

// A claim costs its peer's neighbours one reading at most, however often it is made.
TEST_F(core_ingress, lets_nobody_pass_by_claiming_to_be_a_stop) {
  listen();
  const auto latch = opened_latch();
  for (int i = 0; i < 60; ++i) peers[0]->say(R"({"service":"/rowe/stop","message_id":1,})");
  for (int i = 0; i < 20; ++i) peers[0]->say(R"({"op":"subscribe","topic":"/rowe/stop"})");
  flood({1, 2, 3}, 30);
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 0U);
  EXPECT_LE(on.count(counter::malformed), 26U);
  EXPECT_GE(order().size(), 74U);
  on.cycles(10);
  EXPECT_EQ(on.count(counter::malformed), 60U);
  EXPECT_EQ(on.count(counter::stops), 0U);
}

TEST_F(core_ingress, finds_a_stop_behind_a_frame_of_which_not_even_the_header_is_here_whole) {
  listen();
  const auto latch = opened_latch();
  for (std::size_t split = 1; split < 8; ++split) {
    const auto stops = on.count(counter::stops);
    const std::vector<std::byte> frame = frame_of(rowe::wire::opcode::text, true, say('a', 200));
    peers[0]->send_raw(std::span{frame}.first(split));
    on.cycle();
    peers[0]->send_raw(std::span{frame}.subspan(split));
    flood({0}, 5);
    peers[0]->say(stop_call);
    flood({1, 2, 3}, 60);
    on.cycle();
    EXPECT_EQ(on.count(counter::stops), stops + 1) << split;
    on.cycles(10);
    EXPECT_EQ(std::ranges::count(order(), 'a'), 6) << split;
  }
}

TEST_F(core_ingress, finds_a_stop_behind_a_message_in_pieces_and_none_inside_of_it) {
  listen();
  const auto latch = opened_latch();
  const std::string text = say('a');
  peers[0]->send_raw(frame_of(rowe::wire::opcode::text, false, text.substr(0, 20)));
  peers[0]->send(rowe::wire::opcode::ping, "?");
  on.cycle();
  peers[0]->send_raw(frame_of(rowe::wire::opcode::continuation, false, text.substr(20, 5)));
  peers[0]->send(rowe::wire::opcode::ping, "?");
  peers[0]->send_raw(frame_of(rowe::wire::opcode::continuation, true, text.substr(25)));
  peers[0]->say(stop_call);
  flood({1, 2, 3}, 60);
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
  on.cycles(10);
  EXPECT_EQ(std::ranges::count(order(), 'a'), 1);

  peers[0]->send_raw(frame_of(rowe::wire::opcode::text, false, text.substr(0, 20)));
  peers[0]->say(stop_call); // against the protocol
  flood({1, 2, 3}, 60);
  on.cycles(10);
  EXPECT_EQ(on.count(counter::stops), 1U);
  (void)peers[0]->hear();
  EXPECT_EQ(peers[0]->close_code, rowe::wire::close_code::protocol_error);
}

TEST_F(core_ingress, finds_no_stop_behind_a_close_frame) {
  const auto latch = opened_latch();
  peers[0]->send(rowe::wire::opcode::close, std::string_view{"\x03\xe8", 2});
  peers[0]->say(stop_call);
  on.cycles(3);
  EXPECT_EQ(on.count(counter::stops), 0U);
}

// The stop passes the reset, which stands before it: the peer's last word holds.
TEST_F(core_ingress, refuses_a_reset_that_a_stop_of_the_same_peer_has_passed) {
  auto latch = opened_latch();
  (void)latch.engaged(on.now);
  latch.acknowledge(on.now);
  peers[0]->say(stop_call); // what comes is a repeat, which raises no number
  on.cycle();
  (void)latch.engaged(on.now);
  latch.acknowledge(on.now);
  on.cycles(5);
  (void)latch.engaged(on.now);
  peers[0]->say(R"({"service":"/rowe/stop/state","message_id":1})");
  on.cycle();
  const std::string state = peers[0]->hear().back();
  const auto member = [&](std::string_view name) {
    return std::string{rowe::json::find(rowe::json::root(state).raw, name)->raw};
  };
  peers[0]->say(R"({"service":"/rowe/stop/reset","message_id":2,"number":)" + member("number") +
                R"(,"tick":)" + member("tick") + "}");
  peers[0]->say(stop_call);
  on.cycle();
  EXPECT_TRUE(latch.engaged(on.now));
  bool refused = false;
  for (const std::string& text : peers[0]->hear())
    refused = refused || text.find(R"("refused":"tick")") != std::string::npos;
  EXPECT_TRUE(refused);
}

TEST_F(core_ingress, finds_a_stop_behind_a_frame_that_came_in_two_reads) {
  listen();
  const auto latch = opened_latch();
  flood({1, 2, 3}, 40, 3000);
  peers[0]->say(say('a', 4200)); // more than one read
  peers[0]->say(stop_call);
  on.cycle();
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
}

// ---- shares of whoever receives

// A lane receives; it has ten slots each way, of which two are kept for who comes.
struct receiver_shares : core_ingress {
  receiver_shares() { open(); }

  void open(std::uint32_t depth = 10) {
    pair = &on.offer(lane_request(depth, 4096));
    on.cycle();
    talk = rowe::lane{core_harness::handle_of(*pair)};
  }
  void close() {
    talk = {};
    pair->lifecycle.close();
    on.cycles(2);
  }
  static std::string message_of(char who, std::size_t bytes = 0) {
    return R"({"data":")" + std::string(1, who) + std::string(bytes, '.') + "\"}";
  }
  // Takes what is there, at most so many; the senders.
  std::string taken(std::size_t most = SIZE_MAX) {
    std::string seen;
    while (seen.size() < most) {
      const auto got = talk.try_receive(on.now);
      if (!got) break;
      seen += got->value().substr(9, 1);
    }
    return seen;
  }
  // What is taken in so many cycles.
  std::string taken_in(int cycles) {
    std::string all;
    while (cycles-- > 0) {
      on.cycle();
      all += taken();
    }
    return all;
  }
  // As a program does that sends back what comes. False when a message was refused.
  bool echo() {
    bool all = true;
    while (const auto got = talk.try_receive(on.now))
      all = talk.try_send(got->value(), -1ns, on.now, got->from()).has_value() && all;
    return all;
  }
  std::uint64_t lost() const {
    return on.count(counter::inbox_full) + on.count(counter::outbox_full) + on.count(counter::no_slot);
  }

  rowe::detail::queue_pair* pair = nullptr;
  rowe::lane talk;
};

TEST_F(receiver_shares, leaves_places_in_the_inbox_to_others) {
  for (int i = 0; i < 100; ++i) peers[0]->say(message_of('a'));
  on.cycles(3);
  peers[1]->say(message_of('b'));
  on.cycles(3);
  EXPECT_EQ(taken(), "aaaab");
  EXPECT_EQ(taken_in(50), std::string(96, 'a'));
  EXPECT_EQ(lost(), 0U);
}

// A guard of an older robot calls a name that there is no more. If the program got these calls, the peer
// would be parked once its share is full.
TEST_F(receiver_shares, gives_the_program_no_call_of_names_that_are_the_endpoints_own) {
  for (int i = 0; i < 30; ++i) peers[0]->say(R"({"op":"call_service","id":"g","service":"rowe/stop/lease"})");
  EXPECT_EQ(taken_in(60), "");
  const auto answers = peers[0]->hear();
  ASSERT_EQ(answers.size(), 30U);
  EXPECT_NE(answers[29].find("Service rowe/stop/lease does not exist"), std::string::npos) << answers[29];
}

TEST_F(receiver_shares, has_the_messages_of_several_peers_in_turn) {
  for (std::size_t who = 0; who < 3; ++who)
    for (int i = 0; i < 30; ++i) peers[who]->say(message_of(static_cast<char>('a' + who)));
  const std::string all = taken_in(60);
  ASSERT_EQ(all.size(), 90U);
  for (std::size_t i = 0; i + 9 <= all.size(); i += 3) { // whichever comes first, nobody twice as often
    for (const char who : {'a', 'b', 'c'}) EXPECT_GE(std::count(&all[i], &all[i] + 9, who), 1) << all;
  }
  EXPECT_EQ(lost(), 0U);
}

TEST_F(receiver_shares, counts_what_the_receiver_has_in_its_hands) {
  for (int i = 0; i < 20; ++i) peers[0]->say(message_of('a'));
  on.cycle();
  std::vector<rowe::message_view> held;
  while (auto got = talk.try_receive(on.now)) held.push_back(std::move(*got));
  ASSERT_EQ(held.size(), 4U);
  on.cycles(5);
  EXPECT_EQ(taken(), "");
  held.pop_back();
  on.cycle();
  EXPECT_EQ(taken(), "a");
}

TEST_F(receiver_shares, does_not_read_a_peer_whose_answers_it_cannot_send) {
  on.net.link_of(peers[0]->id()).capacity_bytes = 0;
  for (int i = 0; i < 300; ++i) peers[0]->say(message_of('a', 800)); // in one way, and in the other
  bool all_sent = true;
  for (int i = 0; i < 50; ++i) {
    on.cycle();
    all_sent = echo() && all_sent;
  }
  const auto said = on.count(counter::messages_in);
  EXPECT_LT(said, 100U);
  for (int round = 0; round < 200; ++round) {
    peers[1]->say(message_of('b'));
    texts back;
    for (int cycles = 0; cycles < 4 && back.empty(); ++cycles) {
      on.cycle();
      all_sent = echo() && all_sent;
      back = peers[1]->hear();
    }
    ASSERT_EQ(back, texts{message_of('b')}) << round;
  }
  EXPECT_EQ(on.count(counter::messages_in), said + 200);
  EXPECT_TRUE(all_sent) << "there is room for the answer to each message";
  EXPECT_EQ(lost(), 0U);
  on.net.link_of(peers[0]->id()).capacity_bytes = 1024 * 1024; // now it reads
  std::size_t back = 0;
  for (int i = 0; i < 500 && back < 300; ++i) {
    on.cycle();
    all_sent = echo() && all_sent;
    back += peers[0]->hear().size();
  }
  EXPECT_EQ(back, 300U);
  EXPECT_TRUE(all_sent);
  EXPECT_EQ(lost(), 0U);
}

// Its pongs lie behind what is not read, so they cannot say that it reads.
TEST_F(receiver_shares, goes_on_writing_to_a_peer_that_it_does_not_read) {
  std::size_t back = 0;
  for (int i = 0; i < 400; ++i) peers[0]->say(message_of('a', 3000)); // reads all, and pongs come last
  for (int i = 0; i < 3000 && back < 400; ++i) {
    on.cycle();
    (void)echo();
    back += peers[0]->hear().size();
  }
  EXPECT_EQ(back, 400U);
  EXPECT_EQ(lost(), 0U);
}

TEST_F(receiver_shares, does_not_take_a_peer_that_it_does_not_read_for_silent) {
  for (int i = 0; i < 100; ++i) peers[0]->say(message_of('a'));
  for (int i = 0; i < 400; ++i) { // 40 s
    on.cycle(100ms);
    if (i % 50 == 0) (void)taken(1); // it is there, but slow
    (void)peers[0]->hear();
    for (std::size_t who = 1; who < 4; ++who) (void)peers[who]->hear();
  }
  EXPECT_FALSE(peers[0]->cut());
  EXPECT_GE(peers[0]->pongs, 10) << "it has heard that we are there";
  EXPECT_EQ(on.count(counter::silent_peers) + on.count(counter::slow_peers), 0U);
  EXPECT_EQ(taken_in(100).size(), 92U);
}

TEST_F(receiver_shares, reads_on_where_the_receiver_is_gone_for_long) {
  for (int i = 0; i < 20; ++i) peers[0]->say(message_of('a'));
  peers[0]->say(R"({"op":"subscribe","topic":"/x"})");
  rowe::detail::queue_pair& x = on.offer(rowe::detail::pair_kind::publish_text, "/x", 100);
  on.cycles(70, 100ms);
  EXPECT_EQ(publish_text(on, x, "{}").code(), rowe::errc::no_peer) << "it waits";
  on.cycles(30, 100ms);
  EXPECT_TRUE(publish_text(on, x, "{}"));
  EXPECT_EQ(on.count(counter::inbox_full), 16U);
  EXPECT_EQ(taken(), "aaaa");
}

TEST_F(receiver_shares, lets_a_call_wait_for_a_place) {
  for (int i = 0; i < 4; ++i) peers[0]->say(message_of('a'));
  peers[0]->say(R"({"op":"call_service","id":"7","service":"/any"})");
  peers[0]->say(R"({"service":"any","message_id":8})");
  on.cycles(3);
  EXPECT_EQ(taken(), "aaaa");
  on.cycles(2);
  for (int i = 0; i < 2; ++i) {
    const auto asked = talk.try_receive(on.now);
    ASSERT_TRUE(asked && asked->wants_reply());
    EXPECT_TRUE(talk.try_reply(*asked, R"({"done":true})", on.now));
  }
  on.cycles(2);
  EXPECT_EQ(peers[0]->hear().size(), 2U);
  EXPECT_EQ(on.count(counter::calls_in), 2U);
  EXPECT_EQ(on.count(counter::messages_in), 6U) << "each is counted once";
  EXPECT_EQ(on.count(counter::calls_refused), 0U);
}

TEST_F(receiver_shares, carries_out_a_stop_that_was_read_behind_what_waits) {
  const auto latch = opened_latch();
  for (int i = 0; i < 20; ++i) peers[0]->say(message_of('a'));
  peers[0]->say(stop_call);
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
  EXPECT_EQ(taken(), "aaaa");
  EXPECT_EQ(on.count(counter::inbox_full), 0U) << "what stands before it waits";
  on.cycle();
  EXPECT_EQ(taken(), "aaaa");
}

// Behind a message that is parked more is kept than is read of one peer among others.
TEST(core_ingress_alone, leaves_a_stop_that_is_long_to_its_turn) {
  core_harness on{with_limits(roomy(), &limits::message_bytes_max, 64 * 1024)};
  (void)on.offer(rowe::detail::latch_request({}));
  auto talk = on.open<rowe::lane>(lane_request(2, 4096));
  peer alone{on};
  on.net.link_of(alone.id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_alone_max;
  for (int i = 0; i < 3; ++i) alone.say(R"({"data":"a"})");
  alone.say(R"({"op":"call_service","service":"/rowe/stop","id":")" + std::string(9000, 'x') + "\"}");
  on.cycles(2);
  EXPECT_EQ(on.count(counter::stops), 0U);
  for (int i = 0; i < 5; ++i) {
    while (talk.try_receive(on.now)) continue;
    on.cycle();
  }
  EXPECT_TRUE(on.core.check());
  EXPECT_EQ(on.count(counter::messages_in), 4U) << "all is carried out";
}

// One that is longer than a message may be is read in pieces, in the memory of one that is not whole yet.
TEST(core_ingress_alone, leaves_a_message_whole_beside_a_stop_that_is_too_long) {
  core_harness on{
      with_limits(roomy(), &limits::message_bytes_max, 1024, &limits::long_message_bytes_max, 64 * 1024)};
  (void)on.offer(rowe::detail::latch_request({}));
  auto& pair = on.offer(rowe::detail::pair_kind::subscribe_text, "/t", 1024);
  on.cycle();
  peer alone{on};
  const std::string said = R"({"op":"publish","topic":"/t","msg":{"x":")" + std::string(200, 'a') + "\"}}";
  auto& link = on.net.link_of(alone.id());
  link.arrive_bytes_max = 120;
  alone.say(said);
  alone.say(R"({"op":"call_service","service":"/rowe/stop","id":")" + std::string(200, 'x') +
            R"(","args":{"source":")" + std::string(1100, 'y') + "\"}}");
  on.cycle();
  link.arrive_bytes_max = 4096;
  on.cycles(10);
  const auto slot = pair.user.in.ring->try_pop();
  ASSERT_TRUE(slot);
  EXPECT_EQ(pair.user.in.memory.header(*slot)->bytes, 208U);
  EXPECT_EQ(on.count(counter::malformed), 0U);
}

// One that is read by itself has no more of a cycle than those that are read in turn.
TEST(core_ingress_alone, ends_the_cycle_when_its_work_is_done) {
  core_harness on{with_limits(roomy(), &limits::message_bytes_max, 64 * 1024)};
  (void)on.offer(rowe::detail::latch_request({}));
  on.cycle();
  peer alone{on};
  on.net.link_of(alone.id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_alone_max;
  constexpr std::uint64_t calls = 250;
  for (std::uint64_t i = 0; i < calls; ++i) alone.say(R"({"op":"call_service","service":"/rowe/stats"})");
  alone.say(stop_call);
  on.cycle();
  const std::uint64_t first = on.count(counter::calls_in);
  EXPECT_LT(first, 60U) << "each costs as much as its answer of some kilobytes";
  EXPECT_EQ(on.count(counter::stops), 1U) << "what stops does not wait";
  for (int i = 0; i < 200; ++i) {
    (void)alone.hear_after(1);
    EXPECT_LT(on.count(counter::calls_in), first + static_cast<std::uint64_t>(i + 1) * 60);
  }
  EXPECT_EQ(on.count(counter::calls_in), calls + 1);
}

// Several long ones, each behind the end of the one before in the same read.
TEST(core_ingress_alone, keeps_long_messages_that_find_no_room) {
  core_harness on{with_limits(roomy(), &limits::message_bytes_max, 64 * 1024)};
  auto talk = on.open<rowe::lane>(lane_request(4, 64 * 1024));
  peer alone{on};
  on.net.link_of(alone.id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_alone_max;
  const std::size_t lengths[] = {50'000, 63'000, 20'000, 40'000, 58'000, 61'000, 15'000, 48'000};
  for (const std::size_t bytes : lengths) alone.say(R"({"data":")" + std::string(bytes, 'x') + "\"}");
  std::size_t taken = 0;
  for (int i = 0; i < 400; ++i) {
    on.cycle();
    if (i % 20 != 19) continue;
    if (const auto got = talk.try_receive(on.now)) {
      ASSERT_LT(taken, std::size(lengths));
      EXPECT_EQ(got->value().size(), lengths[taken++] + 11);
    }
  }
  EXPECT_EQ(taken, std::size(lengths));
  EXPECT_EQ(on.count(counter::inbox_full), 0U);
}

// What is left of a read when a cycle's work is done lies where such messages are assembled.
TEST(core_ingress_alone, keeps_what_waits_apart_from_a_message_in_pieces) {
  rowe::endpoint_options options = roomy();
  options.limits.message_bytes_max = 64 * 1024;
  options.relay = true;
  core_harness on{options};
  on.cycle();
  peer alone{on}, reader{on};
  reader.say(R"({"op":"subscribe","topic":"/t"})");
  on.net.link_of(alone.id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_alone_max;
  std::vector<std::string> bodies;
  for (std::size_t i = 0; i < 12; ++i) {
    for (int k = 0; k < 40; ++k) alone.say(R"({"op":"call_service","service":"/rowe/stats"})");
    bodies.push_back(R"({"x":")" + std::string(500 + 4700 * i, static_cast<char>('a' + i)) + "\"}");
    const std::string text = R"({"op":"publish","topic":"/t","msg":)" + bodies.back() + "}";
    const std::size_t third = text.size() / 3;
    alone.send_raw(core_ingress::frame_of(rowe::wire::opcode::text, false, text.substr(0, third)));
    alone.send(rowe::wire::opcode::ping, "?");
    alone.send_raw(
        core_ingress::frame_of(rowe::wire::opcode::continuation, false, text.substr(third, third)));
    alone.send_raw(core_ingress::frame_of(rowe::wire::opcode::continuation, true, text.substr(2 * third)));
  }
  std::string heard;
  for (int i = 0; i < 400; ++i) {
    on.cycle();
    (void)alone.hear();
    heard += reader.hear_as_one();
  }
  for (const std::string& body : bodies) EXPECT_TRUE(has(heard, body)) << body.size();
  EXPECT_EQ(on.count(counter::calls_in), 480U);
  EXPECT_FALSE(alone.cut());
  EXPECT_EQ(on.count(counter::malformed) + on.count(counter::violations), 0U);
  EXPECT_TRUE(on.core.check());
}

TEST_F(receiver_shares, forgets_a_peer_that_left_while_it_waited) {
  for (int i = 0; i < 20; ++i) peers[0]->say(message_of('a'));
  on.cycles(2);
  peers[0]->leave(rowe::service::close_cause::reset);
  on.cycles(2);
  peer next{on};
  for (int i = 0; i < 8; ++i) next.say(message_of('z'));
  on.cycle();
  ASSERT_EQ(next.id().index, peers[0]->id().index);
  EXPECT_EQ(taken(), "aaaazzzz") << "what was there is nobody's share any more";
  on.cycle();
  EXPECT_EQ(taken(), "zzzz");
  peers[0]->leave();
}

TEST_F(receiver_shares, gives_what_waits_to_the_next_receiver) {
  for (int i = 0; i < 20; ++i) peers[0]->say(message_of('a'));
  on.cycles(2);
  EXPECT_EQ(taken(1), "a");
  close();
  open();
  // Between the two nobody received: the shared inbox kept some of them, and one was in its turn.
  EXPECT_EQ(taken_in(20).size() + on.count(counter::inbox_full), 20U - 5U);
}

TEST_F(receiver_shares, keeps_a_place_for_who_comes_last) {
  close();
  open(32);
  std::vector<std::unique_ptr<peer>> greedy;
  for (int i = 0; i < 3; ++i) {
    greedy.push_back(std::make_unique<peer>(on));
    for (int k = 0; k < 100; ++k) greedy.back()->say(message_of('g'));
    on.cycles(3);
  }
  for (auto& one : peers) {
    for (int k = 0; k < 100; ++k) one->say(message_of('g'));
    on.cycles(3);
  }
  const std::size_t theirs = taken().size(); // all are given back
  EXPECT_GE(theirs, 12U);
  for (int k = 0; k < 3; ++k) on.cycle(); // and they have taken as much again
  peer last = peer_saying(on, message_of('l'), 2);
  EXPECT_NE(taken().find('l'), std::string::npos);
}

TEST(shared_inbox_shares, keep_a_place_for_who_comes_last) {
  core_harness on{with_limits(small_options(), &limits::door_slots, 64)};
  const auto taken = [&] {
    std::string senders;
    while (const auto slot = on.inbox.try_receive(on.now)) {
      senders += std::string{on.inbox.text(*slot)}.substr(9, 1);
      (void)on.inbox.release(*slot); // the next cycle comes anyway
    }
    return senders;
  };
  EXPECT_EQ(taken(), ""); // but now somebody receives
  std::vector<std::unique_ptr<peer>> greedy;
  for (int i = 0; i < 7; ++i) {
    greedy.push_back(std::make_unique<peer>(on));
    for (int k = 0; k < 100; ++k) greedy.back()->say(receiver_shares::message_of('g'));
    on.cycles(3);
  }
  peer last = peer_saying(on, receiver_shares::message_of('l'), 3);
  EXPECT_NE(taken().find('l'), std::string::npos);
}

TEST_F(receiver_shares, closes_while_a_peer_waits) {
  for (int i = 0; i < 20; ++i) peers[0]->say(message_of('a'));
  on.cycles(2);
  on.core.close_all(on.now);
  on.cycles(3);
  for (const auto& p : peers) {
    (void)p->hear();
    EXPECT_EQ(p->close_code, 1001);
  }
}

// One that is alone is read in larger pieces than a connection keeps by itself.
TEST(receiver_shares_alone, keeps_what_was_read_at_once) {
  auto options = roomy();
  options.limits.message_bytes_max = 60 * 1024;
  options.answers_any = true;
  core_harness on{options};
  peer one{on};
  on.cycle();
  std::string said;
  const auto send = [&](std::size_t bytes) {
    const std::string name = std::to_string(said.size() % 10);
    said += name;
    one.say(R"({"data":")" + name + std::string(bytes, '.') + "\"}");
  };
  for (int i = 0; i < 40; ++i) send(400);
  send(9000); // begins in one piece and ends in another; too long for the inbox
  said.pop_back();
  for (std::size_t i = 0; i < 40; ++i) send(20 * i);
  std::string seen;
  for (int i = 0; i < 200; ++i) {
    on.cycle();
    EXPECT_TRUE(on.core.check());
    if (const auto slot = on.inbox.try_receive(on.now)) {
      seen += on.inbox.text(*slot)[9];
      on.inbox.release(*slot);
    }
  }
  EXPECT_EQ(seen, said);
  EXPECT_EQ(on.count(counter::too_big), 1U);
  EXPECT_EQ(on.count(counter::inbox_full), 0U);
}

TEST(receiver_shares_hop, reads_no_further_either) {
  auto options = roomy();
  options.profile = rowe::websocket_profile::hop;
  options.answers_any = true;
  core_harness on{options};
  peer one{on};
  on.net.link_of(one.id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_in_turn;
  on.cycle();
  for (int i = 0; i < 20; ++i) one.say(R"({"a":1})");
  on.cycles(100, 100ms);
  std::size_t seen = 0;
  for (int i = 0; i < 20; ++i) {
    on.cycle();
    while (const auto slot = on.inbox.try_receive(on.now)) {
      ++seen;
      on.inbox.release(*slot);
    }
  }
  EXPECT_EQ(seen + on.count(counter::inbox_full), 20U);
  EXPECT_EQ(one.hear(), texts{});
  EXPECT_FALSE(one.cut());
}

} // namespace
} // namespace core_ingress_test
