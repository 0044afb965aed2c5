// SPDX-License-Identifier: Apache-2.0
// How calls end: what this process and its peers answer, and who is told. An end that finds no room is an
// error of whoever answers, who may try again; every other way closes the call.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "wire/text_out.hpp"
#include "json/encoder.hpp"

namespace rowe::service {
namespace {

namespace bare = wire::bare;
namespace rosbridge = wire::rosbridge;

constexpr std::size_t sentence_bytes_max = 320; // the longest service's name in a sentence

// A string's text for people; what does not fit or is no string is shown as it stands there.
std::string_view sentence_of(std::string_view raw, std::span<char> scratch) noexcept {
  if (raw.empty()) return {};
  const json::value v = json::root(raw);
  if (const auto text = json::to_string(v, scratch)) return *text;
  return raw.substr(0, sentence_bytes_max);
}

// rosbridge has no code for a service that nobody provides, but always the same sentence, which names it.
constexpr std::string_view unknown_begins = "Service ";
constexpr std::string_view unknown_ends = " does not exist";

bool says_unknown(std::string_view sentence, std::string_view service) noexcept {
  if (!sentence.starts_with(unknown_begins) || !sentence.ends_with(unknown_ends)) return false;
  sentence.remove_prefix(unknown_begins.size());
  if (sentence.size() < unknown_ends.size()) return false;
  sentence.remove_suffix(unknown_ends.size());
  return !sentence.empty() && without_slash(sentence) == without_slash(service);
}

// A value as the one member of an object.
void write_result(json::writer& into, std::string_view value) noexcept {
  into.begin_object();
  into.key("result");
  into.raw(value);
  into.end_object();
}

} // namespace

// ---- answered by this process

// The call that a handle or a thread answers, provided that it was given to it and has not ended.
result<std::uint32_t> core::find_answered(const party& provider, detail::call_ref which) noexcept {
  call* const found = calls_.find(which);
  const bool own = found != nullptr && found->provider.who == provider.who &&
                   (provider.who != party::kind::lane || (found->provider.index == provider.index &&
                                                          found->provider.generation == provider.generation));
  if (own) return which.index;
  add(counter::replies_unsent);
  return gone_as();
}

// With `waits`, that is told once the answer is written. An error where there is nobody to answer, where it
// is no JSON, where its time is over already, or where it finds no room; then it is not told by this, and
// when there was no room it may try again.
status core::answer_call(const party& provider, detail::call_ref which, const reply& with) noexcept {
  const auto index = find_answered(provider, which);
  if (!index) return index.error();
  if (with.expires < now_) {
    add(counter::expired);
    finish_badly(*index, {errc::refused}, "the reply was not sent within its time to live");
    return errc::expired;
  }
  result<std::uint32_t> slot = no_index;
  if (with.encoder != nullptr) {
    slot = finish(
        *index, [&](json::writer& into) { with.encoder->encode(with.value, into); }, with.expires);
  } else {
    if (const status fine = check_text(with.text); !fine) {
      add(counter::malformed);
      finish_badly(*index, {errc::refused}, "the provider's reply was no proper JSON object");
      return fine;
    }
    slot = finish_with(*index, with.text, with.expires);
  }
  const bool waits = with.waits.who != party::kind::nobody;
  if (!waits) end_without_room(*index, slot);
  if (!slot) return slot.error();
  if (!waits) return {};
  if (*slot == no_index) {
    tell(with.waits, with.own, {}); // to one of this process: it has it
    return {};
  }
  messages_.track_reply(*slot, with.waits, with.own);
  return {};
}

status core::refuse_call(const party& provider, detail::call_ref which, std::string_view why) noexcept {
  const auto index = find_answered(provider, which);
  if (!index) return index.error();
  finish_badly(*index, {errc::refused}, why);
  return {};
}

// ---- answered by peers

void core::take_reply(connection& c, const bare::envelope& said, std::string_view text) noexcept {
  const auto meant = calls_.read_id(said.in_reply_to_raw);
  if (!meant) return add(counter::replies_foreign);
  call* const found = calls_.find(*meant);
  if (found == nullptr) return add(counter::replies_late);
  if (!found->provider.is(c.id)) return add(counter::replies_foreign);
  if (!said.failed) return end_without_room(meant->index, finish_with(meant->index, text));
  std::array<char, sentence_bytes_max> room;
  const errc code = said.error_code == "no_service" ? errc::no_service : errc::refused;
  finish_badly(meant->index, {code}, sentence_of(said.error_text_raw, room));
}

void core::take_service_response(connection& c, const rosbridge::request& said) noexcept {
  const auto meant = calls_.read_id(said.id_raw);
  if (!meant) return add(counter::replies_foreign);
  call* const found = calls_.find(*meant);
  if (found == nullptr) return add(counter::replies_late);
  if (!found->provider.is(c.id)) return add(counter::replies_foreign);
  if (said.result) {
    const std::string_view values = said.values_raw.empty() ? std::string_view{"{}"} : said.values_raw;
    return end_without_room(meant->index, finish_with(meant->index, values));
  }
  std::array<char, sentence_bytes_max> room;
  const std::string_view sentence = sentence_of(said.values_raw, room);
  const bool unknown = says_unknown(sentence, calls_.service(meant->index));
  finish_badly(meant->index, {unknown ? errc::no_service : errc::refused}, sentence);
}

// ---- ends

// The call is answered with the value that `write_body(json::writer&)` writes; towards a peer the answer may
// have a time of its own. Returns the slot of an answer on its way to a peer, or no_index where one of this
// process has it. Errors: peer_lost, closed; full: it found no room, and the call has not ended.
template <class WriteBody>
result<std::uint32_t> core::finish(std::uint32_t index, WriteBody&& write_body,
                                   rt::time_point expires) noexcept {
  const call ended = calls_.at(index);
  if (ended.asked_by.who != party::kind::peer) {
    const std::uint32_t slot = compose(rt::never, write_body);
    if (slot == no_index) return errc::full;
    const auto given = finish_with(index, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
    return given;
  }
  connection* const c = find(ended.asked_by.connection());
  const std::string_view id_raw = calls_.id_raw(index);
  if (c == nullptr || !c->open()) {
    add(counter::replies_unsent);
    close_call(index);
    return gone_as();
  }
  const auto write = [&](json::writer& into) {
    if (ended.asked_by.speaks == dialect::bare) return bare::write_reply(into, id_raw, write_body);
    rosbridge::write_service_response_head(into, calls_.service(index), id_raw, true);
    write_body(into);
    rosbridge::write_service_response_tail(into);
  };
  const std::uint32_t slot = answer(*c, write, expires);
  if (slot == no_index) return errc::full;
  close_call(index);
  return slot;
}

result<std::uint32_t> core::finish_with(std::uint32_t index, std::string_view text,
                                        rt::time_point expires) noexcept {
  const call ended = calls_.at(index);
  if (ended.asked_by.who == party::kind::peer) {
    // In rosbridge's values these are members like others; in a bare reply they would stand beside ours.
    const bool wraps = ended.asked_by.speaks == dialect::bare && bare::find_reserved(text);
    return finish(
        index, [&](json::writer& into) { wraps ? write_result(into, text) : into.raw(text); }, expires);
  }
  // Whoever asked in bare JSON gets an object.
  const bool reads_objects =
      ended.asked_by.who == party::kind::door || lanes_[ended.asked_by.index].kind == detail::lane_kind::talk;
  if (reads_objects && !json::is_object(text)) {
    const std::uint32_t slot = compose(rt::never, [&](json::writer& into) { write_result(into, text); });
    if (slot == no_index) return errc::full;
    close_call(index);
    tell(ended.asked_by, ended.own, {}, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
    return no_index;
  }
  close_call(index);
  tell(ended.asked_by, ended.own, {}, text);
  return no_index;
}

// A call whose reply found no room ends without it, where nobody is to try again.
void core::end_without_room(std::uint32_t index, const result<std::uint32_t>& finished) noexcept {
  if (finished || finished.code() != errc::full) return;
  finish_badly(index, {errc::full}, "the reply finds no room: it is too large, or too many wait");
}

// The call ends without a reply. The one who asked is told why: code and sentence.
void core::finish_badly(std::uint32_t index, const error& why, std::string_view sentence) noexcept {
  const call ended = calls_.at(index);
  std::array<char, 320> room; // of the longest name
  if (why.code == errc::no_service && sentence.empty() && ended.service_bytes != 0) {
    wire::text_out unknown{room};
    sentence = unknown.add(unknown_begins).add(calls_.service(index)).add(unknown_ends).text();
  } else if (why.code == errc::timed_out) {
    sentence = "the service did not answer in time";
  } else if (sentence.empty()) {
    sentence = why.text(room);
  }
  if (ended.asked_by.who != party::kind::peer) {
    close_call(index);
    return tell(ended.asked_by, ended.own, why, sentence);
  }
  add(counter::calls_refused);
  connection* const c = find(ended.asked_by.connection());
  if (c != nullptr && c->open()) {
    const std::string_view id_raw = calls_.id_raw(index);
    if (ended.asked_by.speaks == dialect::bare) {
      answer_bare_error(*c, id_raw, why.name(), sentence);
    } else {
      (void)answer(*c, [&](json::writer& into) { // what is lost is counted there
        rosbridge::write_service_response_head(into, calls_.service(index), id_raw, false);
        into.string(sentence);
        rosbridge::write_service_response_tail(into);
      });
    }
  }
  close_call(index);
}

void core::close_call(std::uint32_t index) noexcept {
  const call& ended = calls_.at(index);
  if (ended.asked_by.who == party::kind::peer) {
    --peer_calls_;
    if (connection* const c = find(ended.asked_by.connection())) call_claims_.give_back(c->calls_asked);
  }
  timers_.disarm(call_index{index});
  messages_.cancel(ended.request);
  calls_.close(index);
}

// A connection is gone: what it asked needs no answer, and what it was to answer has none.
void core::end_calls_of(connection& c) noexcept {
  for (std::uint32_t i = 0; i < services_.places(); ++i) {
    if (!services_.in_use(i) || services_.at(i).lane != no_index || services_.at(i).peer != c.id) continue;
    services_.remove(i);
    service_claims_.give_back(c.services);
  }
  for (std::uint32_t i = 0; i < calls_.places(); ++i) {
    const call& one = calls_.at(i);
    if (!one.open) continue;
    if (one.asked_by.is(c.id)) {
      close_call(i);
    } else if (one.provider.is(c.id)) {
      if (!closing_) add(counter::calls_lost);
      finish_badly(i, {gone_as()});
    }
  }
}

void core::end_calls_of_lane(std::uint32_t lane) noexcept {
  for (std::uint32_t i = 0; i < calls_.places(); ++i) {
    const call& one = calls_.at(i);
    if (!one.open) continue;
    if (one.asked_by.who == party::kind::lane && one.asked_by.index == lane) {
      close_call(i);
    } else if (one.provider.who == party::kind::lane && one.provider.index == lane) {
      finish_badly(i, {errc::no_service});
    }
  }
}

} // namespace rowe::service
