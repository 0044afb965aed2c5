// SPDX-License-Identifier: Apache-2.0
// An untrusted peer: it says anything in any order. It remembers what it has said as far as that was in
// order, so that what it is told can be checked: every message is of its codec and what is JSON there is
// valid, an id is one of its own, as it stood there, and a value from before its subscription is a latched
// one.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "service/core/fragments.hpp"
#include "swarm_context.hpp"
#include "swarm_rights.hpp"
#include "wire/plain/plain.hpp"
#include "wire/png_text.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "json/cbor_text.hpp"

namespace swarm {

// The message that is in CBOR or in a PNG; any other as it is. Nothing where these are not well-formed, or
// hold what is no message of a topic.
inline std::optional<std::string> decoded_encoding(const std::string& message) {
  constexpr std::string_view png = R"({"op":"png","data":")";
  const bool is_png = message.starts_with(png);
  if (!is_png && (message.empty() || message.front() != '\xa3')) return message;
  const std::string_view data = std::string_view{message}.substr(is_png ? png.size() : 0);
  if (is_png && !data.ends_with(R"("})")) return std::nullopt;
  auto json =
      is_png ? rowe::tests::png_text(data.substr(0, data.size() - 2)) : rowe::tests::cbor_text(message);
  if (json && !json->starts_with(R"({"op":"publish","topic":")")) return std::nullopt;
  return json;
}

// Checks every text that a peer is sent. One reader for all: a run has one thread.
class codec_check {
 public:
  enum class kind : std::uint8_t {
    wrong,
    publish,
    status,
    request,
    feedback,
    answer,
    announcement,
    plain_message
  };
  struct heard {
    kind is = kind::wrong;
    std::string id_raw{};
    bool in_plain = false;
    std::string topic{};
    std::string_view body{};
    bool failed = false; // an answer that says why not
    std::string why{};   // wrong
  };

  heard look(std::string_view text) {
    padded_.assign(text);
    padded_.append(rowe::json::reader::tailroom_bytes, '\0');
    text = std::string_view{padded_}.substr(0, text.size());
    if (const auto valid = reader_.validate(text); !valid)
      return {.why = "no valid JSON (" + std::string{valid.error().name()} + " at " +
                     std::to_string(valid.error().value) + ")"};
    if (!rowe::json::is_object(text)) return {.why = "no object"};
    return text.starts_with(R"({"op":")") ? rosbridge(text) : plain(text);
  }

  // Of a part of a message: empty, or what is wrong with it.
  std::string look_at_object(std::string_view text) {
    const std::string why = look_at_value(text);
    return why.empty() && !rowe::json::is_object(text) ? "no object" : why;
  }
  std::string look_at_value(std::string_view text) {
    padded_.assign(text);
    padded_.append(rowe::json::reader::tailroom_bytes, '\0');
    return reader_.validate(std::string_view{padded_}.substr(0, text.size())) ? "" : "no valid JSON";
  }

 private:
  heard rosbridge(std::string_view text) {
    namespace r = rowe::wire::rosbridge;
    using rowe::wire::verb;
    rowe::wire::request said;
    const rowe::wire::name_limits names{.name_bytes_max = 1024, .id_bytes_max = 1024};
    scratch_.resize(r::scratch_bytes(names));
    if (const auto no = r::decode(rowe::json::document{text}, scratch_, names, said)) {
      std::array<char, rowe::wire::refusal::text_bytes_max> why;
      return {.why = std::string{no->text(why)}};
    }
    heard out{.id_raw = std::string{said.id_raw}, .topic = std::string{said.topic}, .body = text};
    switch (said.what) {
    case verb::publish: out.is = kind::publish; break;
    case verb::status: out.is = kind::status; break;
    case verb::send_goal:
    case verb::cancel_goal:
    case verb::call: out.is = kind::request; break;
    case verb::goal_feedback: out.is = kind::feedback; break;
    case verb::goal_result:
    case verb::reply:
      out.is = kind::answer;
      out.failed = said.failed;
      break;
    case verb::set_level:
    case verb::get_parameters:
    case verb::set_parameters:
    case verb::subscribe_parameters:
    case verb::unsubscribe_parameters:
    case verb::subscribe_graph:
    case verb::unsubscribe_graph:
    case verb::unsupported:
    case verb::unknown: out.why = "an operation that nobody sends"; break;
    default: out.is = kind::announcement; break;
    }
    return out;
  }
  heard plain(std::string_view text) {
    namespace b = rowe::wire::plain;
    using rowe::wire::verb;
    rowe::wire::request said;
    auto op = b::op_member::none;
    const rowe::wire::name_limits names{.name_bytes_max = 1024, .id_bytes_max = 1024};
    scratch_.resize(b::scratch_bytes(names));
    if (const auto no = b::decode(rowe::json::document{text}, scratch_, names, said, op)) {
      std::array<char, rowe::wire::refusal::text_bytes_max> why;
      return {.why = std::string{no->text(why)}};
    }
    heard out{.id_raw = std::string{said.id_raw}, .in_plain = true, .body = text, .failed = said.failed};
    out.is = said.what == verb::call    ? kind::request
             : said.what == verb::reply ? kind::answer
                                        : kind::plain_message;
    return out;
  }

  rowe::json::reader reader_{rowe::json::reader::create(256 * 1024, 128).value()};
  std::string padded_;
  std::vector<char> scratch_;
};

class untrusted_peer {
 public:
  // `how`: of "open". A peer on the path of the stop may do nothing else.
  untrusted_peer(context& in, codec_check& check, const recipe& how)
      : in_{in},
        check_{check},
        link_{std::make_unique<far_end>(
            in.on, in.ours, value_of(how, "address") == "loopback" ? "127.0.0.1:50000" : "10.0.0.7:50000",
            value_of(how, "path") == "stop" ? rowe::service::stop_path : "/",
            value_of(how, "codec") == "numbers"   ? subprotocol_of(tongue_of(in, how), in.untrusted)
            : value_of(how, "codec") == "unknown" ? std::string_view{"unknown.v0"}
                                                  : std::string_view{})},
        only_stops_{value_of(how, "path") == "stop"},
        local_{value_of(how, "address") == "loopback"},
        speaks_numbers_{in.numbers && value_of(how, "codec") == "numbers"},
        tongue_{tongue_of(in, how)},
        number_{++in.untrusted},
        name_{"p" + std::to_string(number_)} {
    known_ = in.known;
    known_.speaks = tongue_;
    known_.made_up = "m" + std::to_string(number_) + "_";
    end_conditions();
  }
  ~untrusted_peer() { forget(); }

  far_end& link() { return *link_; }
  const std::string& name() const { return name_; }
  std::uint32_t number() const { return number_; }
  auto& conditions() { return in_.on.net.link_of(link_->id()); }
  void end_conditions() {
    conditions() = {};
    if (in_.takes_rest) conditions().rest_bytes_max = SIZE_MAX;
  }
  bool reads = true;
  bool closing() const { return closing_; }
  bool speaks_numbers() const { return speaks_numbers_; }
  bool speaks_foxglove() const { return tongue_ == tongue::foxglove; }
  // Whether it knows the number of a service that an untrusted peer provides.
  bool knows_number_of_peers_service() const {
    const auto& listed = known_.listed.services.names();
    return std::any_of(listed.begin(), listed.end(), [&](const auto& one) {
      return in_.state_of_service(one.second) == state::service_peers;
    });
  }
  bool flooded() const { return flooded_; } // said more than is read in a while
  std::vector<std::string>& asked() { return known_.asked; }

  void change_conditions() {
    constexpr std::size_t rooms[] = {0, 1, 7, 100, 1000, 20'000, 1'000'000};
    constexpr std::size_t chunks[] = {1, 2, 13, 500, 65536};
    auto& c = conditions();
    c.capacity_bytes = in_.random.one_of(rooms);
    c.chunk_bytes_max = in_.random.one_of(chunks);
    c.rest_bytes_max = in_.takes_rest || in_.random.one_in(2) ? SIZE_MAX : in_.random.one_of(rooms);
    c.arrive_bytes_max = in_.random.one_in(3) ? in_.random.below(40) : SIZE_MAX;
    reads = !in_.random.one_in(4);
    link_->answers_pings = !in_.random.one_in(8);
    in_.say(name_ + " link: room " + std::to_string(c.capacity_bytes) + ", chunk " +
            std::to_string(c.chunk_bytes_max) + ", arrive " + std::to_string(c.arrive_bytes_max) +
            (reads ? "" : ", does not read") + (link_->answers_pings ? "" : ", answers no pings"));
  }

  // Says one text of the recipe, `times` over; with `undone` so many of both, in turn.
  void say(const recipe& what, std::uint64_t times, bool bursts_are_one_write,
           const recipe* undone = nullptr) {
    refresh_knowledge();
    flooded_ = flooded_ || times > 1000;
    std::vector<std::byte> together;
    const state how = undone != nullptr ? state::times_in_turn
                      : times > 1       ? state::times_burst
                                        : state::times_once;
    if (undone != nullptr) times *= 2;
    for (std::uint64_t i = 0; i < times; ++i) {
      const recipe& now = undone != nullptr && i % 2 != 0 ? *undone : what;
      const saying said = render(in_.random, now, known_);
      if (i == 0 && times > 1) in_.say(name_ + " " + std::to_string(times) + " times like:");
      if (i < 2) {
        count_coverage(now, said, how);
        trace(said);
      }
      note(said);
      const form goes = operations()[said.operation].goes;
      if (bursts_are_one_write && times > 1 && is_message(goes)) {
        append_frame(together, is_binary(goes) ? rowe::wire::opcode::binary : rowe::wire::opcode::text,
                     said.text);
      } else {
        put(said);
      }
    }
    if (!together.empty()) link_->send_raw(together);
  }

  void hear(std::size_t bytes_max) {
    for (const std::string& text : link_->hear(bytes_max)) {
      if (const auto whole = fragments_.take(text)) hear_text(*whole);
      if (!fragments_.wrong.empty())
        return in_.fail("protocol", name_ + " was sent: " + shortened(fragments_.wrong));
    }
    if (!link_->violated.empty() && !unmasked_is_right())
      in_.fail("frames", name_ + " was sent what breaks the protocol: " + link_->violated);
  }

  // Its places are given back: it has gone.
  void forget() {
    for (const auto& [topic, s] : subscriptions_) --in_.held[topic];
    for (const auto& [topic, latch] : advertised_) --in_.held[topic];
    for (const auto& service : services_) --in_.provided[service];
    subscriptions_.clear();
    advertised_.clear();
    services_.clear();
    if (std::exchange(gone_, true)) return;
    for (publication& one : in_.published) {
      if (one.by == number_) one.gone = in_.step;
    }
  }

 private:
  struct request {
    std::int64_t throttle_ms = 0;
    bool queue_stated = false;
  };
  struct subscription {
    std::map<std::string, request> requests; // by their ids
    std::uint64_t since = 0;                 // the step in which it was asked for
    bool first = true;                       // of this peer on this topic
    std::uint64_t heard = 0;
  };

  static tongue tongue_of(const context& in, const recipe& how) {
    const bool foxglove = in.foxglove && in.untrusted % 2 == 0 && value_of(how, "codec") == "numbers";
    return foxglove ? tongue::foxglove : tongue::numbers;
  }
  static std::string_view subprotocol_of(tongue speaks, std::uint32_t number) {
    if (speaks == tongue::numbers) return numbers::subprotocol;
    return number % 4 == 0 ? foxglove::subprotocol : foxglove::older_subprotocol;
  }

  // A client of profile hop_2014 is sent unmasked frames by design.
  bool unmasked_is_right() const {
    return in_.ours == rowe::service::side::client &&
           in_.on.options.profile == rowe::websocket_profile::hop_2014;
  }

  void refresh_knowledge() {
    known_.bounds = in_.known.bounds;
    known_.stop_number = in_.known.stop_number;
    known_.tick = in_.known.tick;
    known_.control_tick = in_.known.control_tick;
    known_.old_stops = in_.known.old_stops;
    known_.asked_of_others = in_.known.asked_of_others;
    known_.honest_topics = in_.known.honest_topics;
    known_.names = in_.known.names;
    known_.message_number = &in_.message_number;
  }

  void append_frame(std::vector<std::byte>& to, rowe::wire::opcode what, std::string_view payload,
                    bool last = true) const {
    const bool masked = in_.ours == rowe::service::side::server;
    const rowe::wire::mask_key key{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
    const std::size_t at = to.size();
    to.resize(at + rowe::wire::frame_header_bytes_max + payload.size());
    const std::size_t header = rowe::wire::write_frame_header(to.data() + at, what, payload.size(),
                                                              masked ? std::optional{key} : std::nullopt);
    if (!last) to[at] &= std::byte{0x7f};
    payload.copy(reinterpret_cast<char*>(to.data() + at + header), payload.size());
    to.resize(at + header + payload.size());
    if (masked) rowe::wire::mask(std::span{to}.subspan(at + header), key);
  }

  void put(const saying& said) {
    using rowe::wire::opcode;
    const operation& of = operations()[said.operation];
    switch (of.goes) {
    case form::rosbridge:
    case form::plain:
    case form::stop_call:
    case form::stop_plain:
    case form::stop_publish:
    case form::number_text:
    case form::foxglove_text:
    case form::malformed: return link_->say(said.text);
    case form::number_binary:
    case form::number_stop:
    case form::binary: return link_->send(opcode::binary, said.text);
    case form::control: return link_->send(of.name == "ping" ? opcode::ping : opcode::pong, said.text);
    case form::close: return link_->send(opcode::close, said.text);
    case form::fragments: {
      std::vector<std::byte> bytes;
      for (std::size_t i = 0; i < said.parts.size(); ++i) {
        append_frame(bytes, i == 0 ? opcode::text : opcode::continuation, said.parts[i],
                     i + 1 == said.parts.size());
        if (in_.random.one_in(4)) append_frame(bytes, opcode::ping, "between");
      }
      return link_->send_raw(bytes);
    }
    case form::partial: {
      std::vector<std::byte> bytes;
      append_frame(bytes, opcode::text, said.text);
      const std::size_t now = 1 + in_.random.below(bytes.size());
      // The rest of the frame is the beginning of the next text, so it is rarely right.
      return link_->send_raw(std::span{bytes}.first(in_.random.one_in(2) ? bytes.size() : now));
    }
    case form::no_frame: return link_->send_raw(std::as_bytes(std::span{said.text}));
    case form::opening:
    case form::submission:
    case form::thread_stop: return; // no peer says that
    }
  }

  void trace(const saying& said) const {
    if (!in_.trace) return;
    const operation& of = operations()[said.operation];
    std::string text = name_ + " ";
    if (!is_message(of.goes) || is_binary(of.goes)) text += std::string{of.name} + " ";
    in_.say(text + shortened(said.text));
  }

  // ---- what it remembers

  // Not those of another codec than its own.
  bool knows(const operation& of) const {
    const speaker by = speaker_of(of.goes);
    if (by == speaker::foxglove_peer) return speaks_foxglove();
    return by == speaker::any_peer || (by == speaker::numbers_peer) == speaks_numbers_;
  }
  bool accepted(const saying& said) const {
    return said.good && !closing_ && !only_stops_ && knows(operations()[said.operation]);
  }

  void note(const saying& said) {
    const operation& of = operations()[said.operation];
    if (!said.id_raw.empty()) ids_.insert(said.id_raw);
    if (!said.answers.empty()) ids_.insert(said.answers);
    if (said.resets) in_.resets.insert({said.number, said.tick});
    const bool binary = is_binary(of.goes);
    if (binary && said.text.size() >= 9 && said.text.front() == (speaks_foxglove() ? '\x02' : 'c'))
      ids_.insert(said.text.substr(5, 4));
    if (of.goes == form::rosbridge || of.goes == form::stop_call || of.goes == form::stop_publish)
      spoke_plain_last_ = false;
    if (of.goes == form::plain || of.goes == form::stop_plain) spoke_plain_last_ = true;
    if (of.goes == form::close || of.goes == form::no_frame || (binary && !speaks_numbers_) ||
        (of.goes == form::partial))
      closing_ = true;
    said_something_ = true;
    for (const numbered& one : said.elements) given_numbers_.insert(one.number);
    if (of.name == "command" && said.message != 0) note_command(said);
    if (said.asks_rights) rights_.insert(said.id_raw + rights_answer_without_roles(said.rights, local_));
    if (!accepted(said)) return;
    if (of.name == "subscribe" || of.name == "watch_control") return note_subscribe(said);
    if (of.name == "unsubscribe") return note_unsubscribe(said);
    if (of.name == "advertise") return note_advertise(said);
    if (of.name == "unadvertise") return note_unadvertise(said);
    if (of.goes == form::number_text) {
      for (const numbered& one : said.elements) note_element(of, one);
      return;
    }
    if (of.name == "publish" || of.name == "publish_by_number") {
      if (said.message != 0) in_.note_publication(said.message, number_, said.latch || latches(said.topic));
      return;
    }
    if (of.name == "call_service" || of.name == "send_action_goal" || of.name == "invocation" ||
        of.name == "call_by_number" || of.name.starts_with("control") || said.asks_rights) {
      if (known_.own_calls.size() < 8 && !said.id_raw.empty()) known_.own_calls.push_back(said.id_raw);
      if (said.id_raw.empty()) unnamed_calls_ = true;
    }
    if (of.name == "service_response" || of.name == "reply" || of.name == "error" ||
        of.name == "action_result") {
      const auto at = std::find(known_.asked.begin(), known_.asked.end(), said.answers);
      if (at == known_.asked.end()) return;
      known_.asked.erase(at);
      known_.answered.push_back(said.answers);
      if (known_.answered.size() > 4) known_.answered.erase(known_.answered.begin());
    }
    if (of.name == "advertise_service" &&
        services_.size() < in_.known.bounds.advertisements_per_connection_max &&
        !said.service.starts_with("/rowe/") && services_.insert(said.service).second)
      ++in_.provided[said.service];
    if (of.name == "unadvertise_service" && services_.erase(said.service) != 0) --in_.provided[said.service];
    if (operations()[said.operation].goes == form::stop_call && said.id_raw.empty()) unnamed_calls_ = true;
  }

  // A tick that was made up counts from when it is issued.
  void note_command(const saying& said) {
    const std::int64_t ahead = said.tick - in_.known.control_tick;
    const bool may_come = ahead > 0 && ahead < 1'000'000;
    const std::uint32_t n = in_.note_publication(said.message, number_, false);
    if (may_come) in_.published[n].said += 1ms * ahead;
  }

  // By the list as it was read last: a number may be gone, which is refused.
  void note_element(const operation& of, const numbered& one) {
    auto& numbers = of.name == "want" || of.name == "drop" ? known_.tags : known_.channels;
    const bool takes = of.name == "want" || of.name == "offer";
    const auto known = numbers.find(one.number);
    if (!takes) {
      if (known == numbers.end()) return;
      const saying about{.topic = known->second};
      numbers.erase(known);
      return of.name == "drop" ? note_unsubscribe(about) : note_unadvertise(about);
    }
    const saying about{.topic = one.topic};
    const bool has_another = std::any_of(numbers.begin(), numbers.end(),
                                         [&](const auto& other) { return other.second == one.topic; });
    if (known != numbers.end() || has_another || one.topic.empty() || one.number == rowe::wire::no_number)
      return;
    of.name == "want" ? note_subscribe(about) : note_advertise(about);
    if (of.name == "want" ? subscriptions_.contains(one.topic) : advertised_.contains(one.topic))
      numbers[one.number] = one.topic;
  }

  bool latches(const std::string& topic) const {
    const auto found = advertised_.find(topic);
    return found != advertised_.end() && found->second;
  }

  void note_subscribe(const saying& said) {
    const bool fresh = !subscriptions_.contains(said.topic);
    if (fresh && subscriptions_.size() >= in_.known.bounds.subscriptions_per_connection_max) return;
    subscription& s = subscriptions_[said.topic];
    if (fresh) {
      ++in_.held[said.topic];
      s.since = in_.step;
      s.first = subscribed_once_.insert(said.topic).second;
    }
    if (s.requests.size() == 4 && !s.requests.contains(said.id_raw)) return;
    s.requests[said.id_raw] = {said.throttle_ms, said.queue_stated};
  }
  void note_unsubscribe(const saying& said) {
    const auto found = subscriptions_.find(said.topic);
    if (found == subscriptions_.end()) return;
    if (!said.id_raw.empty()) {
      if (found->second.requests.erase(said.id_raw) == 0 || !found->second.requests.empty()) return;
    }
    subscriptions_.erase(found);
    --in_.held[said.topic];
  }
  void note_advertise(const saying& said) {
    if (said.topic.starts_with("/rowe/")) return;
    const auto found = advertised_.find(said.topic);
    if (found != advertised_.end()) {
      found->second = found->second || said.latch;
      return;
    }
    if (advertised_.size() >= in_.known.bounds.advertisements_per_connection_max) return;
    advertised_[said.topic] = said.latch;
    ++in_.held[said.topic];
  }
  void note_unadvertise(const saying& said) {
    if (advertised_.erase(said.topic) != 0) --in_.held[said.topic];
  }

  // ---- coverage

  bool backpressured() {
    return conditions().capacity_bytes <= 7 || (!reads && conditions().capacity_bytes <= 1000);
  }
  state state_of_connection() {
    if (closing_) return state::connection_closing;
    if (!said_something_) return state::connection_fresh;
    if (backpressured()) return state::connection_backpressured;
    if (speaks_foxglove()) return state::connection_foxglove;
    if (speaks_numbers_) return state::connection_numbers;
    return spoke_plain_last_ ? state::connection_plain : state::connection_rosbridge;
  }
  state state_of_subscription(const std::string& topic) {
    const auto found = subscriptions_.find(topic);
    if (found == subscriptions_.end()) return state::subscription_none;
    if (backpressured()) return state::subscription_backpressured;
    bool queue = false;
    std::int64_t throttle = INT64_MAX;
    for (const auto& [id, r] : found->second.requests) {
      queue = queue || r.queue_stated;
      throttle = std::min(throttle, r.throttle_ms);
    }
    if (throttle == 0 || found->second.requests.empty()) return state::subscription_idle;
    return queue ? state::subscription_queued : state::subscription_throttled;
  }
  state state_of_answer(const saying& said) const {
    const auto in = [&](const std::vector<std::string>& of) {
      return std::find(of.begin(), of.end(), said.answers) != of.end();
    };
    return in(known_.asked)      ? state::answer_asked
           : in(known_.answered) ? state::answer_over
                                 : state::answer_foreign;
  }
  state state_of_call(const saying& said) const {
    const auto& open = known_.own_calls;
    if (open.empty()) return state::call_none;
    return std::find(open.begin(), open.end(), said.id_raw) != open.end() ? state::call_same_id
                                                                          : state::call_open;
  }

  void count_coverage(const recipe& what, const saying& said, state times) {
    for (const dimension d : operations()[what.operation].of) {
      // What another codec says names nothing here.
      if (d != dimension::connection && d != dimension::times && !knows(operations()[what.operation]))
        continue;
      state now = state::connection_fresh;
      switch (d) {
      case dimension::topic: now = in_.state_of_topic(said.topic); break;
      case dimension::subscription: now = state_of_subscription(said.topic); break;
      case dimension::service: now = in_.state_of_service(said.service); break;
      case dimension::call: now = state_of_call(said); break;
      case dimension::answer: now = state_of_answer(said); break;
      case dimension::stop: now = in_.state_of_stop(); break;
      case dimension::connection: now = state_of_connection(); break;
      case dimension::times: now = times; break;
      case dimension::queue:
      case dimension::inbox:
      case dimension::outcome:
      case dimension::heard: continue; // of threads
      }
      in_.seen.add(row_of(what.operation), now);
      for (std::size_t m = 0; m < what.classes.size(); ++m)
        in_.seen.add(row_of(what.operation, m, what.classes[m]), now);
    }
  }

  // ---- what it receives

  void hear_text(const std::string& message) {
    const auto as_json = speaks_numbers_ ? std::optional{message} : decoded_encoding(message);
    if (!as_json) return in_.fail("json", name_ + " was sent no CBOR, or no PNG: " + shortened(message, 700));
    const std::string& text = *as_json;
    // Plain messages, and calls of a peer that the caller names, are of another codec.
    const bool plain = text.starts_with('{') && !text.starts_with(R"({"op":)");
    if (speaks_foxglove() && !plain) return hear_by_foxglove(text);
    if (speaks_numbers_ && !plain) return hear_by_number(text);
    using kind = codec_check::kind;
    const codec_check::heard h = check_.look(text);
    if (h.is == kind::wrong)
      return in_.fail("json", name_ + " was sent " + shortened(text, 700) + ": " + h.why);
    if (h.is == kind::announcement && in_.ours == rowe::service::side::server)
      return in_.fail("grammar", name_ + " was sent what only clients say: " + shortened(text));
    if (h.is == kind::status || h.is == kind::feedback || h.is == kind::answer) {
      if (!h.id_raw.empty() && !ids_.contains(h.id_raw))
        return in_.fail("ids", name_ + " was answered under an id that it never gave: " + shortened(text));
      const auto at = std::find(known_.own_calls.begin(), known_.own_calls.end(), h.id_raw);
      if (h.is == kind::answer && at != known_.own_calls.end()) known_.own_calls.erase(at);
    }
    if (h.is == kind::request) {
      known_.asked.push_back(h.id_raw);
      if (known_.asked.size() > 16) known_.asked.erase(known_.asked.begin());
      auto& others = in_.known.asked_of_others;
      others.push_back(h.id_raw);
      if (others.size() > 8) others.erase(others.begin());
    }
    if (h.is == kind::publish) hear_publication(h);
    if (in_.drives) hear_of_control(text);
    if (in_.rights && h.is == kind::answer)
      hear_of_rights(text, h.id_raw,
                     h.in_plain ? flow_event::anybody_rights_plain : flow_event::anybody_rights);
  }

  // Each answer must be one to what it asked under this id.
  void hear_of_rights(std::string_view text, const std::string& id, flow_event by) {
    const std::string answer = rights_answer_in(text);
    if (answer.empty()) return;
    if (!rights_.contains(id + answer))
      return in_.fail("rights", name_ + " is told of its rights what is not so: " + shortened(text, 700));
    in_.seen.add(by);
    in_.seen.add(local_ ? flow_event::anybody_rights_here : flow_event::anybody_rights_elsewhere);
  }

  void hear_of_control(const std::string& text) {
    using event = flow_event;
    const auto has = [&](std::string_view part) { return text.find(part) != text.npos; };
    if (has(R"("topic":"/rowe/control/state")")) return in_.seen.add(event::anybody_watches);
    if (!has(R"("refused":)") || !has(R"("tick":)") || has("/rowe/stop")) return;
    const bool fine = has(R"("refused":null)");
    const bool was = std::exchange(drives_, has(R"("yours":true)"));
    if (fine && drives_ && !was) in_.seen.add(event::anybody_takes);
    if (fine && was && !drives_) in_.seen.add(event::anybody_releases);
    if (has(R"("refused":"topic")")) in_.seen.add(event::anybody_no_topic);
    if (has(R"("refused":"action")")) in_.seen.add(event::anybody_no_action);
    if (has(R"("refused":"tick")")) in_.seen.add(event::anybody_old_tick);
    if (has(R"("refused":"driven")")) in_.seen.add(event::anybody_driven);
    if (has(R"("refused":"pause")")) in_.seen.add(event::anybody_pause);
  }

  void hear_by_foxglove(const std::string& text) {
    const auto heard = foxglove::as_numbers(
        text, [&](const std::string& json) { return check_.look_at_object(json).empty(); });
    if (!heard.wrong.empty())
      return in_.fail("json", name_ + " was sent " + shortened(text, 700) + ": " + heard.wrong);
    if (!heard.of_others) return hear_by_number(heard.text);
    const std::string id = foxglove::text_in(rowe::json::find(rowe::json::root(text).raw, "id")).value_or("");
    if (!id.empty() && !ids_.contains('"' + id + '"'))
      in_.fail("ids", name_ + " was answered under an id that it never gave: " + shortened(text));
  }
  void hear_by_number(const std::string& text) {
    const auto wrong = [&](std::string_view invariant, const std::string& why) {
      in_.fail(invariant, name_ + " was sent " + shortened(text) + ": " + why);
    };
    if (number_lists::is_list(text)) {
      if (const std::string why = known_.listed.take(text); !why.empty()) wrong("listing", why);
      return;
    }
    const char kind = text.empty() ? ' ' : text.front();
    if (kind == 'e') return;
    const std::size_t head = kind == 'm' ? 13 : 5;
    if ((kind != 'm' && kind != 'r' && kind != 'f') || text.size() < head)
      return wrong("json", "its codec has no such message");
    const std::string_view body = std::string_view{text}.substr(head);
    // What a service replies may be any value.
    const std::string why = kind == 'm'   ? check_.look_at_object(body)
                            : kind == 'r' ? check_.look_at_value(body)
                                          : std::string{};
    if (!why.empty()) return wrong("json", why);
    if (kind == 'm') {
      if (!given_numbers_.contains(numbers::number_at(std::string_view{text}.substr(1))))
        wrong("ids", "it never gave this number");
      const std::int64_t n = integer_after(body, R"({"n":)");
      if (n <= 0) return;
      publication& p = in_.message(static_cast<std::uint32_t>(n));
      if (p.heard == 0) p.heard = in_.step;
      return;
    }
    const std::string id = text.substr(1, 4);
    if (!ids_.contains(id)) return wrong("ids", "it never gave this id");
    const auto at = std::find(known_.own_calls.begin(), known_.own_calls.end(), id);
    if (at != known_.own_calls.end()) known_.own_calls.erase(at);
  }

  void hear_publication(const codec_check::heard& h) {
    const std::int64_t n = integer_after(h.body, R"("msg":{"n":)");
    if (n <= 0) return;
    publication& p = in_.message(static_cast<std::uint32_t>(n));
    const std::string topic = h.topic.starts_with('/') ? h.topic : "/" + h.topic;
    const auto found = subscriptions_.find(topic);
    if (found != subscriptions_.end() && found->second.first && p.by != 0 &&
        !in_.once_latched.contains(topic)) {
      const std::uint64_t since = found->second.since;
      if (p.gone != 0 && p.gone < since)
        in_.fail("latch", name_ + " subscribed to " + h.topic + " in step " + std::to_string(since) +
                              " and got message " + std::to_string(n) + " of p" + std::to_string(p.by) +
                              ", which left in step " + std::to_string(p.gone));
      if (!p.may_be_kept && p.heard != 0 && p.heard < since)
        in_.fail("latch", name_ + " subscribed to " + h.topic + " in step " + std::to_string(since) +
                              " and got message " + std::to_string(n) + " of p" + std::to_string(p.by) +
                              ", which did not ask that it be kept and was heard in step " +
                              std::to_string(p.heard));
    }
    if (p.heard == 0) p.heard = in_.step;
  }

  context& in_;
  codec_check& check_;
  std::unique_ptr<far_end> link_;
  bool only_stops_;
  bool local_;
  bool speaks_numbers_;
  fragments::reassembly fragments_; // of what it asked for
  tongue tongue_;
  std::uint32_t number_;
  std::string name_;
  knowledge known_;
  std::set<std::string> ids_;
  std::map<std::string, subscription> subscriptions_;
  std::set<std::string> subscribed_once_;
  std::map<std::string, bool> advertised_; // whether latched
  std::set<std::string> services_;
  std::set<std::string> rights_;          // what it may be told of them, behind the id
  std::set<std::uint32_t> given_numbers_; // to subscriptions and channels
  bool spoke_plain_last_ = false;
  bool said_something_ = false;
  bool closing_ = false;
  bool flooded_ = false;
  bool unnamed_calls_ = false;
  bool gone_ = false;
  bool drives_ = false; // as it was told last
};

} // namespace swarm
