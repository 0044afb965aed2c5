// SPDX-License-Identifier: Apache-2.0
// Takes what handles publish that may publish long texts, or structs whose text may be long: copies a long
// text into chunks and checks it, or encodes the struct into chunks, some of it in a cycle. Its handle holds
// the slot meanwhile, and nothing behind it is taken, so its values stay in their order. One long text is
// taken at a time; other such handles wait for their turn.
//
// Service thread only; nothing waits or allocates.
#pragma once
#include <cstddef>

#include <rowe/detail/queue_pair.hpp>

#include "service/outgoing/long_outbox.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/broker.hpp"
#include "service/topics/topic_handles.hpp"
#include "service/topics/value_publisher.hpp"
#include "json/reading/scanner.hpp"
#include "json/structs/encoder_pieces.hpp"

namespace rowe::service {

struct long_publications_needs {
  core_state& state_;
  long_outbox& long_outbox_;
  sender& sender_;
  broker& broker_;
  value_publisher& value_publisher_;
  topic_handles& topic_handles_;
};

class long_publications : long_publications_needs {
 public:
  explicit long_publications(const long_publications_needs& parts) noexcept
      : long_publications_needs{parts} {}

  // Takes what a handle whose row has `long_texts` submitted, up to a long text, and some of that.
  void take(pair_index pair) noexcept;
  // Whether a long text of the handle is being taken.
  bool has_begun(pair_index pair) const noexcept { return pair_ == pair && pair; }
  bool any() const noexcept { return static_cast<bool>(pair_); }

 private:
  void take_newest(pair_index pair) noexcept;
  void take_values(pair_index pair) noexcept;
  bool begins(pair_index pair, pair_slot slot) noexcept;
  void begin_struct() noexcept;
  bool advance() noexcept;
  bool advance_text() noexcept;
  bool advance_struct() noexcept;
  void publish() noexcept;
  void drop_too_long(std::size_t bytes) noexcept;
  void drop() noexcept;

  pair_index pair_{}; // the handle whose text is being taken; none: none is
  pair_slot slot_{};
  text_id text_{}; // none: it is dropped
  std::size_t done_ = 0;
  json::scanner scanner_;         // of a text
  json::encoder_pieces pieces_{}; // of a struct
};

} // namespace rowe::service
