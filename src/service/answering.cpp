// SPDX-License-Identifier: Apache-2.0
// How calls end: what this process and its peers answer, and who is told. An end that finds no room is an
// error of whoever answers, who may try again; every other way closes the call.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "wire/object_form.hpp"
#include "json/encoder.hpp"

namespace rowe::service {
namespace {

// A string's text for people; what does not fit or is no string is shown as it stands there.
std::string_view sentence_of(std::string_view raw, std::span<char> scratch) noexcept {
  if (raw.empty()) return {};
  const json::value v = json::root(raw);
  if (const auto text = json::to_string(v, scratch)) return *text;
  return raw.substr(0, scratch.size());
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
    const auto encode = [&](json::writer& into) { with.encoder->encode(with.value, into); };
    slot = finish(*index, wire::body{encode}, with.expires);
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

void core::take_reply(connection& c, const wire::request& said) noexcept {
  const auto meant = calls_.read_id(said.id_raw);
  if (!meant) return add(counter::replies_foreign);
  call* const found = calls_.find(*meant);
  if (found == nullptr) return add(counter::replies_late);
  if (!found->provider.is(c.id)) return add(counter::replies_foreign);
  if (!said.failed) {
    const std::string_view value = said.body_raw.empty() ? std::string_view{"{}"} : said.body_raw;
    return end_without_room(meant->index, finish_with(meant->index, value));
  }
  std::array<char, wire::no_service_bytes_max> room;
  const std::string_view sentence = sentence_of(said.body_raw, room);
  const bool unknown =
      protocols_.of(said.codec).means_no_service(said, sentence, calls_.service(meant->index));
  finish_badly(meant->index, {unknown ? errc::no_service : errc::refused}, sentence);
}

// ---- ends

// The call is answered with a value; towards a peer the answer may have a time of its own. Returns the slot
// of an answer on its way to a peer, or no_index where one of this process has it. Errors: peer_lost, closed;
// full: it found no room, and the call has not ended.
result<std::uint32_t> core::finish(std::uint32_t index, const wire::body& value,
                                   rt::time_point expires) noexcept {
  const call ended = calls_.at(index);
  if (ended.asked_by.who != party::kind::peer) {
    const std::uint32_t slot = compose(rt::never, [&](json::writer& into) { value.write(into); });
    if (slot == no_index) return errc::full;
    const auto given = finish_with(index, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
    return given;
  }
  connection* const c = find(ended.asked_by.connection());
  if (c == nullptr || !c->open()) {
    add(counter::replies_unsent);
    close_call(index);
    return gone_as();
  }
  const wire::codec& codec = protocols_.of(ended.asked_by.speaks);
  const wire::call_origin asked{.service = calls_.service(index), .id_raw = calls_.id_raw(index)};
  const std::uint32_t slot = answer(
      *c, [&](json::writer& into) { codec.write_reply(into, asked, value); }, expires);
  if (slot == no_index) return errc::full;
  close_call(index);
  return slot;
}

result<std::uint32_t> core::finish_with(std::uint32_t index, std::string_view text,
                                        rt::time_point expires) noexcept {
  const call ended = calls_.at(index);
  if (ended.asked_by.who == party::kind::peer) return finish(index, wire::body{text}, expires);
  // Whoever asked with an object gets one.
  const bool reads_objects =
      ended.asked_by.who == party::kind::door || lanes_[ended.asked_by.index].kind == detail::lane_kind::talk;
  if (reads_objects && !json::is_object(text)) {
    const std::uint32_t slot =
        compose(rt::never, [&](json::writer& into) { wire::write_result(into, text); });
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
  std::array<char, wire::no_service_bytes_max> room;
  if (why.code == errc::no_service && sentence.empty() && ended.service_bytes != 0) {
    sentence = wire::no_service_sentence(calls_.service(index), room);
  } else if (why.code == errc::timed_out) {
    sentence = "the service did not answer in time";
  } else if (sentence.empty()) {
    sentence = why.message(room);
  }
  if (ended.asked_by.who != party::kind::peer) {
    close_call(index);
    return tell(ended.asked_by, ended.own, why, sentence);
  }
  add(counter::calls_refused);
  connection* const c = find(ended.asked_by.connection());
  if (c != nullptr && c->open()) {
    answer_failure(*c, ended.asked_by.speaks,
                   {.service = calls_.service(index), .id_raw = calls_.id_raw(index)},
                   {.code = why.name(), .text = sentence});
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
