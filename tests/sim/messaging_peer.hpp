// SPDX-License-Identifier: Apache-2.0
// A peer that sends messages and calls, by both codecs. What it receives is compared with the ledger. It
// remembers the calls that it got and made, so that it can answer well or badly, and be answered once.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ledger.hpp"
#include "sim_base.hpp"
#include "stream.hpp"

namespace sim {

// What the parts of a world share.
struct world_context {
  harness::core_harness& on;
  random_source& random;
  ledger& book;
};

class messaging_peer {
 public:
  struct request { // a call that it got
    std::string id_raw;
    std::uint32_t call = 0;
    bool rosbridge = false;
  };

  messaging_peer(world_context& in, rowe::service::side ours)
      : in_{in}, link_{std::make_unique<harness::peer>(in.on, ours)}, number_{in.book.new_actor()} {}

  std::uint32_t number() const { return number_; }
  rowe::connection named() const { return {link_->id().index, link_->id().generation}; }
  harness::peer& link() { return *link_; }
  std::vector<request>& asked() { return asked_; }
  bool well_behaved = true; // else we may have disconnected it
  bool answers_pings = true;

  // What the core has written since the last look.
  void note_writes() {
    const auto bytes = in_.on.net.sent(link_->id());
    const std::size_t known = std::min<std::size_t>(written_.end() - read_, bytes.size());
    if (known == bytes.size()) return;
    const std::size_t before = written_.complete.size();
    written_.take(bytes.subspan(known), in_.on.now);
    if (written_.broken()) in_.book.fail("a peer was sent a frame that it must not be sent");
    for (std::size_t i = before; i < written_.complete.size(); ++i) {
      const written_frame& frame = written_.complete[i];
      if (!frame.whole_text()) continue;
      const std::string text = without_ttl(frame.payload);
      if (text.size() != frame.payload.size())
        in_.book.told_ttl(number_after(text, R"("n":)"), frame.payload, frame.begun);
      if (text.starts_with(R"({"n":)")) {
        in_.book.wrote_message(number_after(text, R"("n":)"), number_, frame.begun);
      } else if (is_request(text)) {
        in_.book.wrote_request(number_after(text, R"("a":)"), number_, frame.begun);
      }
    }
  }

  // Reads so much of it.
  void read(std::size_t bytes_max) {
    const std::size_t bytes = std::min(bytes_max, in_.on.net.sent(link_->id()).size());
    in_.on.net.peer_reads(link_->id(), bytes);
    read_ += bytes;
    while (!written_.complete.empty() && written_.complete.front().end <= read_) {
      const written_frame frame = std::move(written_.complete.front());
      written_.complete.pop_front();
      if (frame.whole_text()) hear(frame.payload);
      if (frame.ping() && answers_pings) link_->send(rowe::wire::opcode::pong, frame.payload);
    }
  }

  // ---- calls

  // A call of `service`; its id is one of before now and then.
  void ask(std::string_view service, bool rosbridge, duration timeout) {
    const auto& options = in_.on.options;
    const std::uint32_t k =
        in_.book.new_call(std::min(rowe::rt::deadline_after(in_.on.now, timeout),
                                   rowe::rt::deadline_after(in_.on.now, options.inbound_ttl)));
    in_.book.call(k).by_peer = true;
    std::string id = in_.random.one_in(2) ? std::to_string(k) : "\"q" + std::to_string(k) + '"';
    if (!calls_.empty() && in_.random.one_in(8)) id = calls_.rbegin()->first;
    const bool unnamed = rosbridge && in_.random.one_in(8);
    if (id.empty()) id = "17"; // of one that had no name
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(timeout).count();
    std::string text;
    if (rosbridge) {
      text = R"({"op":"call_service",)";
      if (unnamed) {
        id.clear();
      } else {
        text += R"("id":)" + id + ",";
      }
      if (ms >= 0) text += R"("timeout":)" + std::to_string(static_cast<double>(ms) / 1000) + ",";
      text +=
          R"("service":")" + std::string{service} + R"(","args":{"a":)" + std::to_string(k) + R"(,"b":0}})";
    } else {
      text = R"({"service":")" + std::string{service} + R"(","a":)" + std::to_string(k) + R"(,"b":0,)";
      if (ms >= 0) text += R"("ttl_ms":)" + std::to_string(ms) + ",";
      text += R"("message_id":)" + id + "}";
    }
    calls_[id].limited =
        calls_[id].limited && (timeout >= duration{0} || options.inbound_ttl != rowe::rt::for_ever);
    calls_[id].calls.push_back(k);
    ++calls_[id].waiting;
    link_->say(text);
  }

  // How many of its calls were not answered although their deadlines have passed.
  std::size_t overdue() const {
    std::size_t count = 0;
    for (const auto& [id, under] : calls_) count += under.limited ? under.waiting : 0;
    return count;
  }

  // ---- answers

  enum class manner { well, refusing, twice, under_another_id };

  void answer(std::size_t which, manner how) {
    const request r = asked_[which];
    asked_.erase(asked_.begin() + static_cast<std::ptrdiff_t>(which));
    switch (how) {
    case manner::twice:
      say_answer(r, in_.book.new_answer(r.call));
      say_answer(r, in_.book.new_answer(r.call));
      break;
    case manner::well: say_answer(r, in_.book.new_answer(r.call)); break;
    case manner::refusing:
      in_.book.refuse(r.call);
      say_refusal(r);
      break;
    case manner::under_another_id: {
      request other = r;
      switch (in_.random.below(4)) {
      case 0: other.id_raw = "17"; break;
      case 1: other.id_raw = "\"\""; break;
      case 2: other.id_raw[1] = other.id_raw[1] == '1' ? '2' : '1'; break;   // of another endpoint
      default: other.id_raw.insert(other.id_raw.size() - 1, "00000"); break; // of a far later call
      }
      say_answer(other, in_.book.new_false_answer());
      break;
    }
    }
  }
  // The calls that others got.
  void answer_for(const request& r) { say_answer(r, in_.book.new_false_answer()); }

 private:
  struct calls_of_id {
    std::vector<std::uint32_t> calls;
    std::size_t waiting = 0; // of these
    bool limited = true;     // each has a time by which it ends
  };

  static bool is_request(std::string_view text) {
    return text.starts_with(R"({"op":"call_service")") ||
           (!text.starts_with(R"({"op":)") && text.find(R"("message_id":)") != std::string_view::npos);
  }

  // A plain message as its sender wrote it.
  static std::string without_ttl(std::string_view text) {
    const auto end = text.starts_with(R"({"ttl_ms":)") ? text.find_first_of(",}") : text.npos;
    if (end == text.npos) return std::string{text};
    return "{" + std::string{text.substr(text[end] == ',' ? end + 1 : end)};
  }

  void hear(std::string_view given) {
    const std::string text = without_ttl(given);
    if (text.starts_with(R"({"n":)")) return; // the ledger knows it
    const bool rosbridge = text.starts_with(R"({"op":)");
    if (is_request(text)) {
      asked_.push_back({std::string{raw_after(text, rosbridge ? R"("id":)" : R"("message_id":)")},
                        number_after(text, R"("a":)"), rosbridge});
      return;
    }
    if (text.starts_with(R"({"op":"service_response")")) {
      const auto id = text.substr(0, text.find(R"("service":)")); // what was answered may have an "id"
      return answered(std::string{raw_after(id, R"("id":)")}, text,
                      text.find(R"("result":true)") == text.npos);
    }
    if (rosbridge) return;
    if (const auto id = raw_after(text, R"("in_reply_to":)"); !id.empty())
      answered(std::string{id}, text, text.starts_with(R"({"error":)"));
  }

  void answered(const std::string& id, std::string_view text, bool refused) {
    const auto found = calls_.find(id);
    if (found == calls_.end())
      return in_.book.fail("a peer was answered what it does not ask: " + std::string{text});
    auto& [calls, waiting, limited] = found->second;
    if (waiting-- == 0) return in_.book.fail("a peer was answered twice: " + std::string{text});
    const std::uint32_t r = refused ? 0 : number_after(text, R"("sum":)");
    const bool timed_out = refused && text.find("in time") != std::string_view::npos;
    const auto right = std::find(calls.begin(), calls.end(), in_.book.call_of_answer(r));
    const std::uint32_t k = right != calls.end() ? *right : calls[0];
    if (calls.size() == 1 || r != 0) // else nobody can say which of those under one id was refused
      in_.book.ended(k, r, timed_out ? errc::timed_out : errc::refused, in_.on.now);
  }

  void say_answer(const request& r, std::uint32_t answer) {
    const std::string value = R"("sum":)" + std::to_string(answer);
    if (r.rosbridge) {
      link_->say(R"({"op":"service_response","id":)" + r.id_raw + R"(,"service":"x","values":{)" + value +
                 R"(},"result":true})");
    } else {
      link_->say("{" + value + R"(,"in_reply_to":)" + r.id_raw + "}");
    }
  }
  void say_refusal(const request& r) {
    if (r.rosbridge) {
      link_->say(R"({"op":"service_response","id":)" + r.id_raw +
                 R"(,"service":"x","values":"no","result":false})");
    } else {
      link_->say(R"({"error":{"code":"no","text":"no"},"in_reply_to":)" + r.id_raw + "}");
    }
  }

  world_context& in_;
  std::unique_ptr<harness::peer> link_;
  std::uint32_t number_;
  stream written_;
  std::uint64_t read_ = 0;
  std::vector<request> asked_;
  std::map<std::string, calls_of_id> calls_; // its own
};

} // namespace sim
