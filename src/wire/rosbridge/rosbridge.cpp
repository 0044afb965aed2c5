// SPDX-License-Identifier: Apache-2.0
// Decoding. One walk over the object records the value of each known member. Then the operation says which of
// them matter. So the order of members does not matter, and a name that occurs twice is found before anything
// is used.
#include "wire/rosbridge/rosbridge.hpp"

#include <algorithm>
#include <limits>

#include "wire/codec/members.hpp"
#include "wire/codec/time_to_live.hpp"
#include "wire/rosbridge/rosbridge_operations.hpp"
#include "wire/rosbridge/rosbridge_values.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire::rosbridge {
namespace {

constexpr std::size_t op_bytes_max = 64;
static_assert(scratch_bytes({.name_bytes_max = 0, .id_bytes_max = 0}) >= op_bytes_max);

constexpr std::int64_t any_count = std::numeric_limits<std::int64_t>::max();

// A known member, written as its name; another name does not compile.
struct member_name {
  std::size_t index;
  consteval member_name(const char* name) : index{0} { // NOLINT(google-explicit-constructor): need("topic")
    index = member_names.find(name);
    if (index == member_names.size()) throw "no such member";
  }
  std::string_view text() const noexcept { return member_names[index]; }
};

enum policy : std::size_t { history, depth, reliability, durability, deadline, lifespan };
constexpr word_table policy_names{"history", "depth", "reliability", "durability", "deadline", "lifespan"};
constexpr std::array<std::string_view, 6> policy_paths = {"qos.history",    "qos.depth",    "qos.reliability",
                                                          "qos.durability", "qos.deadline", "qos.lifespan"};

// One text being decoded. Each step returns false when it refused; then refusal_ says why.
class decoding {
 public:
  decoding(const json::document& text, std::span<char> scratch, const name_limits& limits,
           request& out) noexcept
      : text_{text}, scratch_{scratch}, limits_{limits}, out_{out}, found_{collect(text, member_names)} {}

  std::optional<refusal> run() noexcept;

 private:
  bool accept(std::optional<refusal> wrong) noexcept {
    refusal_ = wrong;
    if (refusal_) refusal_->verb_text = out_.verb_text;
    return !wrong;
  }
  bool given(member_name which) const noexcept { return found_.given(which.index); }
  const json::value& value(member_name which) const noexcept { return found_.values[which.index]; }

  bool take_op() noexcept;
  bool take_id() noexcept;
  bool take_members() noexcept;
  bool take_publish() noexcept;
  bool take_status() noexcept;
  bool take_subscribe() noexcept;
  bool take_advertise() noexcept;
  bool take_call_service() noexcept;
  bool take_service_response() noexcept;
  bool take_goal() noexcept;
  bool take_goal_result() noexcept;

  bool need(member_name which) noexcept;
  bool take_topic() noexcept { return take_name("topic", out_.topic); }
  bool take_service() noexcept { return take_name("service", out_.service); }
  bool take_name(member_name which, std::string_view& into) noexcept;
  bool take_action() noexcept { return take_name("action", out_.service); }
  // In an answer, whose id says what it answers.
  bool take_answered(member_name which) noexcept {
    return (!given(which) && !out_.id_raw.empty()) || take_name(which, out_.service);
  }
  bool take_values() noexcept;
  bool need_id() noexcept {
    return !out_.id_raw.empty() || accept(refusal{.what = refusal::kind::missing, .member = "id"});
  }
  bool take_called_service() noexcept;
  bool take_id_of_service(std::string_view escaped) noexcept;
  bool take_args() noexcept;
  bool take_timeout() noexcept;
  bool take_ttl() noexcept { return !given("ttl_ms") || accept(read_ttl(value("ttl_ms"), out_.ttl_ns)); }
  bool take_type(member_name which) noexcept;
  bool take_throttle() noexcept {
    return !given("throttle_rate") || accept(read_throttle(value("throttle_rate"), out_.throttle_ms));
  }
  bool take_count(member_name which, std::int64_t most, std::int64_t& into) noexcept;
  bool take_boolean(member_name which, bool& into) noexcept;
  bool take_level() noexcept;
  bool take_transfer() noexcept;
  bool take_qos() noexcept;

  std::span<char> carve(std::size_t bytes) noexcept {
    const std::span<char> piece = scratch_.first(std::min(bytes, scratch_.size()));
    scratch_ = scratch_.subspan(piece.size());
    return piece;
  }

  const json::document& text_;
  std::span<char> scratch_;
  const name_limits& limits_;
  request& out_;
  members<member_names.size()> found_;
  std::optional<refusal> refusal_;
};

std::optional<refusal> decoding::run() noexcept {
  if (!json::is_object(text_.text)) return refusal{.what = refusal::kind::not_an_object};
  const bool id_is_good = take_id(); // first, because the answer carries it whatever else is wrong
  const auto wrong_id = refusal_;
  if (!take_op()) return refusal_;
  if (!id_is_good) {
    (void)accept(wrong_id); // again, now that the operation is known
  } else if (const auto twice = found_.twice()) {
    (void)accept(refusal{.what = refusal::kind::twice, .member = member_names[*twice]});
  } else {
    (void)take_members();
  }
  return refusal_;
}

bool decoding::take_id() noexcept {
  const member_name id{"id"};
  if (!given(id) || found_.repeats(id.index)) return true;
  const json::value& v = value(id);
  if (v.type == json::kind::null) return true; // what the reference server takes for none
  if (v.type != json::kind::string && !json::to_integer(v) && !json::to_unsigned(v)) {
    return accept(wrong_type("id", v, "a string or an integer"));
  }
  if (v.raw.size() > limits_.id_bytes_max) return accept(too_long("id", v.raw.size(), limits_.id_bytes_max));
  out_.id_raw = v.raw;
  return true;
}

bool decoding::take_op() noexcept {
  const member_name which{"op"};
  if (!given(which)) {
    return accept(
        refusal{.what = refusal::kind::missing,
                .member = "op",
                .expected = R"(it says what to do, for example {"op":"subscribe","topic":"/odom"})"});
  }
  if (found_.repeats(which.index)) return accept(refusal{.what = refusal::kind::twice, .member = "op"});
  const json::value& v = value(which);
  if (v.type == json::kind::string) {
    const std::size_t known = find_escaped(operation_names, v.raw.substr(1, v.raw.size() - 2));
    if (known != operation_names.size()) {
      out_.verb_text = operations[known].text;
      out_.what = operations[known].what;
      return true;
    }
  }
  out_.what = verb::unknown;
  return accept(read_name("op", v, op_bytes_max, carve(op_bytes_max), out_.verb_text));
}

bool decoding::take_members() noexcept {
  switch (out_.what) {
  case verb::publish: return take_publish();
  case verb::subscribe: return take_subscribe();
  case verb::advertise: return take_advertise();
  case verb::unsubscribe:
  case verb::unadvertise: return take_topic();
  case verb::status: return take_status();
  case verb::set_level: return take_level();
  case verb::call: return take_call_service();
  case verb::reply: return take_service_response();
  case verb::advertise_service: return take_service() && take_type("type");
  case verb::unadvertise_service: return take_service();
  case verb::advertise_action: return take_action() && take_type("type");
  case verb::unadvertise_action: return take_action();
  case verb::send_goal: return take_goal();
  case verb::cancel_goal: return take_action() && need_id();
  case verb::goal_feedback: return take_action() && take_values();
  case verb::goal_result: return take_goal_result();
  case verb::fragment: return need_id() && accept(read_fragment(text_, out_));
  case verb::message:
  case verb::get_parameters:
  case verb::set_parameters:
  case verb::subscribe_parameters:
  case verb::unsubscribe_parameters:
  case verb::subscribe_graph:
  case verb::unsubscribe_graph:
  case verb::unsupported:
  case verb::unknown: return true;
  }
  return true;
}

// The operations.

bool decoding::take_publish() noexcept {
  if (!take_topic() || !need("msg")) return false;
  const json::value& v = value("msg");
  if (v.type != json::kind::object) return accept(wrong_type("msg", v, "an object"));
  out_.body_raw = v.raw;
  return take_type("type") && take_boolean("latch", out_.latch) && take_ttl() &&
         take_count("tick", any_count, out_.tick);
}

bool decoding::take_status() noexcept {
  if (!take_level() || !need("msg")) return false;
  const json::value& v = value("msg");
  if (v.type != json::kind::string) return accept(wrong_type("msg", v, "a string"));
  out_.body_raw = v.raw;
  return true;
}

bool decoding::take_subscribe() noexcept {
  out_.has_queue_length = given("queue_length");
  return take_topic() && take_type("type") && take_throttle() &&
         take_count("queue_length", any_count, out_.queue_length) && take_transfer() && take_qos();
}

bool decoding::take_advertise() noexcept {
  return take_topic() && take_type("type") && take_boolean("latch", out_.latch) &&
         take_count("queue_size", any_count, out_.queue_size) && take_qos();
}

bool decoding::take_call_service() noexcept {
  return take_called_service() && take_args() && take_timeout() && take_transfer();
}

bool decoding::take_service_response() noexcept {
  bool succeeded = true;
  if (!take_answered("service") || !take_boolean("result", succeeded)) return false;
  out_.failed = !succeeded;
  if (given("values")) out_.body_raw = value("values").raw;
  return true;
}

bool decoding::take_goal() noexcept {
  return take_action() && take_type("action_type") && take_args() &&
         take_boolean("feedback", out_.feedback) && take_timeout() && take_transfer();
}

bool decoding::take_values() noexcept {
  if (!need("values")) return false;
  out_.body_raw = value("values").raw;
  return true;
}

bool decoding::take_goal_result() noexcept {
  bool succeeded = true;
  std::int64_t goal_status = 0;
  const bool good = take_answered("action") && take_boolean("result", succeeded) &&
                    take_count("status", std::numeric_limits<std::int8_t>::max(), goal_status);
  out_.failed = !succeeded;
  out_.goal_status = static_cast<std::int8_t>(goal_status);
  if (given("values")) out_.body_raw = value("values").raw;
  return good;
}

// The members.

bool decoding::need(member_name which) noexcept {
  return given(which) || accept(refusal{.what = refusal::kind::missing, .member = which.text()});
}

bool decoding::take_name(member_name which, std::string_view& into) noexcept {
  if (!need(which)) return false;
  const std::size_t most = limits_.name_bytes_max;
  if (!accept(read_name(which.text(), value(which), most, carve(most), into))) return false;
  return !into.empty() || accept(refusal{.what = refusal::kind::empty, .member = which.text()});
}

// The name of a service that is called may end in "#" and the call's id.
bool decoding::take_called_service() noexcept {
  json::value& name = found_.values[member_name{"service"}.index];
  const std::size_t mark = name.raw.find('#'); // no escape has one in it
  if (name.type != json::kind::string || mark == std::string_view::npos) return take_service();
  const std::string_view id = name.raw.substr(mark + 1, name.raw.size() - mark - 2);
  name.raw = name.raw.substr(0, mark + 1); // the mark in place of the closing quote
  return (!out_.id_raw.empty() || take_id_of_service(id)) && take_service();
}

// The id is echoed like one that was sent, so it gets quotes.
bool decoding::take_id_of_service(std::string_view escaped) noexcept {
  const std::size_t bytes = escaped.size() + 2;
  const std::span<char> quoted = carve(limits_.id_bytes_max);
  if (bytes > quoted.size()) return accept(too_long("id", bytes, limits_.id_bytes_max));
  quoted[0] = '"';
  std::copy(escaped.begin(), escaped.end(), quoted.begin() + 1);
  quoted[bytes - 1] = '"';
  out_.id_raw = {quoted.data(), bytes};
  return true;
}

bool decoding::take_args() noexcept {
  if (!given("args") || value("args").type == json::kind::null) return true;
  const json::value& v = value("args");
  if (v.type != json::kind::object && v.type != json::kind::array) {
    return accept(wrong_type("args", v, "an object or an array"));
  }
  out_.body_raw = v.raw;
  return true;
}

bool decoding::take_timeout() noexcept {
  return !given("timeout") || accept(read_timeout("timeout", value("timeout"), out_.ttl_ns));
}

bool decoding::take_type(member_name which) noexcept {
  const std::size_t most = limits_.name_bytes_max;
  return !given(which) || accept(read_name(which.text(), value(which), most, carve(most), out_.type));
}

bool decoding::take_count(member_name which, std::int64_t most, std::int64_t& into) noexcept {
  return !given(which) || accept(read_count(which.text(), value(which), most, into));
}

bool decoding::take_boolean(member_name which, bool& into) noexcept {
  if (!given(which)) return true;
  const auto word = json::to_boolean(value(which));
  if (!word) return accept(wrong_type(which.text(), value(which), "true or false"));
  into = *word;
  return true;
}

bool decoding::take_level() noexcept {
  if (!need("level")) return false;
  static constexpr std::string_view words[] = {"none", "error", "warning", "info"};
  std::size_t word = 0;
  const bool good =
      accept(read_word("level", value("level"), words, R"("none", "error", "warning" or "info")", word));
  if (good) out_.level = static_cast<severity>(word);
  return good;
}

// How topics' messages are sent. Answers to calls are JSON, as those of the reference server.
bool decoding::take_transfer() noexcept {
  if (given("fragment_size") && value("fragment_size").type != json::kind::null &&
      !accept(read_at_least("fragment_size", value("fragment_size"), fragment_size_min, out_.fragment_size)))
    return false;
  if (!given("compression")) return true;
  const json::value& v = value("compression");
  if (v.type != json::kind::string) return accept(wrong_type("compression", v, "a string"));
  static constexpr std::array<std::string_view, 4> words{"none", "png", "cbor", "cbor-raw"};
  std::size_t word = 0;
  const bool known = !read_word("compression", v, words, {}, word);
  if (known) out_.encoding = static_cast<std::uint8_t>(word);
  return known || accept(refusal{.what = refusal::kind::not_offered,
                                 .member = "compression",
                                 .value = v.raw,
                                 .expected = R"("none", "png", "cbor", "cbor-raw")"});
}

// Quality of service: rowe takes what it can do, and checks the rest.
bool decoding::take_qos() noexcept {
  if (!given("qos")) return true;
  if (value("qos").type != json::kind::object) return accept(wrong_type("qos", value("qos"), "an object"));
  const auto found = collect(value("qos").raw, policy_names);
  if (const auto twice = found.twice()) {
    return accept(refusal{.what = refusal::kind::twice, .member = policy_paths[*twice]});
  }
  static constexpr std::string_view histories[] = {"keep_last", "keep_all"};
  static constexpr std::string_view reliabilities[] = {"reliable", "best_effort", "best_available"};
  static constexpr std::string_view durabilities[] = {"volatile", "transient_local", "best_available"};
  const auto word = [&](policy which, std::span<const std::string_view> words, std::string_view expected,
                        std::string_view wanted, bool& is_wanted) {
    if (!found.given(which)) return true;
    std::size_t index = 0;
    if (!accept(read_word(policy_paths[which], found.values[which], words, expected, index))) return false;
    if (words[index] == wanted) is_wanted = true;
    return true;
  };
  const auto duration = [&](policy which, std::int64_t& into) {
    return !found.given(which) || accept(read_duration(policy_paths[which], found.values[which], into));
  };
  bool reliable = false; // TCP is, whatever is asked for
  const bool words_are_good =
      word(history, histories, R"("keep_last" or "keep_all")", "keep_all", out_.keep_all) &&
      word(reliability, reliabilities, R"("reliable", "best_effort" or "best_available")", "reliable",
           reliable) &&
      word(durability, durabilities, R"("volatile", "transient_local" or "best_available")",
           "transient_local", out_.latch);
  if (!words_are_good) return false;
  if (found.given(depth)) {
    out_.has_queue_length = true;
    if (!accept(read_count(policy_paths[depth], found.values[depth], any_count, out_.queue_length)))
      return false;
  }
  const bool as_available = found.given(deadline) && is_word(found.values[deadline], "best_available");
  return (as_available || duration(deadline, out_.deadline_ns)) && duration(lifespan, out_.lifespan_ns);
}

} // namespace

std::optional<refusal> decode(const json::document& validated_text, std::span<char> scratch,
                              const name_limits& limits, request& out) noexcept {
  return decoding{validated_text, scratch, limits, out}.run();
}

} // namespace rowe::wire::rosbridge
