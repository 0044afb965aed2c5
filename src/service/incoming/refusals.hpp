// SPDX-License-Identifier: Apache-2.0
// What is reported to peers about refused requests, and how often. Each refusal names the value and the
// limit. A peer that is refused all the time is not answered each time, cannot fill the ring of events, and
// is closed in the end. Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/event.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/base/rate_limit.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/request.hpp"
#include "wire/protocols/protocols.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

using close_reason = event::text<wire::close_reason_bytes_max>;

// Why a peer gets no more of a pool; see shares.hpp.
struct taken_share {
  std::string_view what;
  std::uint32_t held; // pieces that the peer holds
  std::uint32_t left; // free pieces of those for peers
  std::uint32_t for_peers;
  std::uint32_t kept; // free pieces that are reserved for claims
  std::string_view option;
};

struct refusals_needs {
  core_state& state_;
  outbox& outbox_;
};

class refusals : refusals_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<row>(bounds.connections_max);
  }
  refusals(rt::arena& memory, const refusals_needs& parts) noexcept;

  void open(peer_index peer) noexcept;

  // Refuses a request. A status says why, in the codec of the request, and an event reports it, unless either
  // happens too often.
  void refuse(connection& c, wire::codec_id in, std::string_view id_raw,
              const wire::diagnostic& why) noexcept;
  // The same. A call or a goal with a number to answer to is answered as one, even if it was not decoded, and
  // however often: its caller waits.
  void refuse(connection& c, const wire::request& asked, const wire::diagnostic& why) noexcept;
  // Refuses a call or a goal. It is always answered, because its caller waits.
  void refuse_call(connection& c, const wire::request& asked, const wire::diagnostic& why) noexcept {
    report(c, event::kind::refused_request, why.text, {});
    answer_call(c, asked, why);
  }
  // A request that is dropped because its peer exceeds its rate. A call or a goal with a number fails.
  void fail_excess(connection& c, const wire::request& asked) noexcept;
  // Refuses a request about topics or services.
  void refuse(connection& c, std::string_view id_raw, std::string_view why) noexcept;
  // The same for a topic that a publisher of this process does not share.
  void refuse_own_topic(connection& c, std::string_view id_raw, std::string_view verb,
                        std::string_view topic) noexcept;
  // `what` is used up. A status names the limit, and an event says how to raise it.
  void refuse_limit(connection& c, std::string_view id_raw, std::string_view what, std::uint64_t limit,
                    std::string_view option) noexcept;
  void refuse_share(connection& c, const wire::request& asked, const taken_share& of) noexcept;
  // The peer's role does not allow the request (access_control). Counted and reported as a denial.
  void deny(connection& c, const wire::request& asked, std::string_view why) noexcept;
  // The peer calls a service that nobody provides here. Counted as a refused call.
  void refuse_unknown(connection& c, const wire::request& asked) noexcept;
  // Warns a peer that what it got is not what it expects. Sent and counted as a refusal.
  void warn(connection& c, std::string_view id_raw, std::string_view why,
            wire::severity how = wire::severity::error) noexcept;
  // The same, without the limit on how often.
  void send_status(connection& c, std::string_view id_raw, std::string_view why,
                   wire::severity how = wire::severity::error) noexcept;
  // A call of the peer has failed. Always answered; if there is no room the answer is lost, and counted.
  void fail_call(connection& c, wire::codec_id in, const wire::call_origin& call,
                 const wire::diagnostic& why) noexcept;

  // Counts a refusal that another part reports. False: too many, for which the peer may be closed.
  bool within_rate(connection& c) noexcept;
  // Reports a refusal by an event, or only counts it.
  void report(connection& c, event::kind kind, std::string_view why, std::string_view remedy) noexcept;
  // Called periodically: reports how many refusals were only counted.
  void report_missed(connection& c) noexcept;
  // Whether the peer may cause one more event now.
  bool admits_event(peer_index peer) noexcept { return rows_[peer].reports.take(state_.cycle.now); }
  void set_level(peer_index peer, wire::severity level) noexcept { rows_[peer].level = level; }

  // A message exceeds the peer's rate. The peer is closed if that goes on.
  void note_excess(connection& c) noexcept;

 private:
  // Of one peer.
  struct row {
    rate_limit refused;                             // limits its refusals,
    rate_limit reports;                             // and the events about them
    std::uint32_t unreported = 0;                   // since the last event
    wire::severity level = wire::severity::warning; // what it wants to get
  };

  void add(counter which) noexcept { state_.counts.add(which); }
  static bool is_answerable(const wire::request& asked) noexcept {
    const bool call = asked.what == wire::verb::call || asked.what == wire::verb::send_goal;
    return call && (asked.by_number || !asked.id_raw.empty());
  }
  void answer_call(connection& c, const wire::request& asked, const wire::diagnostic& why) noexcept;
  bool admits(connection& c, event::kind kind, std::string_view why, std::string_view remedy) noexcept;
  void answer(connection& c, wire::codec_id in, std::string_view id_raw,
              const wire::diagnostic& why) noexcept;
  void say(connection& c, wire::codec_id in, std::string_view id_raw, const wire::diagnostic& why,
           wire::severity how = wire::severity::error) noexcept;
  void refuse_for(connection& c, std::string_view id_raw, wire::text_out& why,
                  std::string_view option) noexcept;
  void close_if_flooding(connection& c, const rate_limit& rate, std::string_view why) noexcept;

  rows<peer_index, row> rows_;
  close_reason too_many_messages_;
  close_reason too_many_refusals_;
};

} // namespace rowe::service
