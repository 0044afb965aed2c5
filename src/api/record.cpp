// SPDX-License-Identifier: Apache-2.0
// The public recorder of an endpoint.
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <rowe/detail/pair_request.hpp>
#include <rowe/endpoint.hpp>
#include <rowe/recording.hpp>

#include "api/endpoint_recorder.hpp"
#include "api/endpoint_state.hpp"

namespace rowe {

namespace detail {
namespace {
constexpr std::size_t recorders_max = 16; // more than there may be, whoever opens some at the same time
}

result<queue_pair*> endpoint_state::begin_recording(endpoint_recorder& by) {
  {
    const std::lock_guard set_up{set_up_};
    recorders_.reserve(recorders_.size() + recorders_max); // so that nothing is left to fail
  }
  auto opened = open_pair(record_request(by));
  if (!opened) return opened;
  const std::lock_guard set_up{set_up_};
  recorders_.push_back(&by);
  return opened;
}

void endpoint_state::end_recording(queue_pair& gone, endpoint_recorder& by) noexcept {
  const std::lock_guard set_up{set_up_};
  std::erase(recorders_, &by);
  gone.lifecycle.close();
  if (closed_) return; // there is no service thread
  transport_->wake();
  (void)gone.lifecycle.wait_while_closing(gone.arrival, rt::never);
}

} // namespace detail

struct recorder::parts {
  std::shared_ptr<detail::endpoint_state> on;
  std::unique_ptr<detail::endpoint_recorder> by;
  detail::queue_pair* pair; // null: closed
  std::vector<detail::pair_handle> subscribed{};

  parts(std::shared_ptr<detail::endpoint_state> of, std::unique_ptr<detail::endpoint_recorder> to,
        detail::queue_pair* opened) noexcept
      : on{std::move(of)}, by{std::move(to)}, pair{opened} {}
  parts(const parts&) = delete;
  parts& operator=(const parts&) = delete;
  ~parts() {
    subscribed.clear();
    if (on->forked())
      (void)by.release(); // its thread is the parent's
    else
      stop();
  }
  void stop() {
    if (pair == nullptr) return;
    on->end_recording(*std::exchange(pair, nullptr), *by);
    by->finish(rt::for_ever);
  }
};

recorder::recorder() noexcept = default;
recorder::recorder(std::unique_ptr<parts> made) noexcept : parts_{std::move(made)} {}
recorder::recorder(recorder&&) noexcept = default;
recorder& recorder::operator=(recorder&&) noexcept = default;
recorder::~recorder() = default;

result<recorder> endpoint::record(const record_options& options, std::string* why) {
  if (const status mine = usable(); !mine) return mine.error();
  try {
    record_options chosen = options;
    if (chosen.file.name.empty()) chosen.file.name = state_->name();
    auto by = detail::endpoint_recorder::start(chosen, state_->topics_max(), why);
    if (!by) return by.error();
    auto made = std::make_unique<recorder::parts>(state_, std::move(*by), nullptr);
    auto pair = state_->begin_recording(*made->by);
    if (!pair) {
      made->by->files().discard();
      return pair.error();
    }
    made->pair = *pair;
    return recorder{std::move(made)};
  } catch (const std::bad_alloc&) {
    return errc::no_memory;
  }
}

status recorder::subscribe(std::string_view topic, std::string_view type, const schema_description* schema,
                           rt::duration throttle) {
  if (!parts_ || parts_->pair == nullptr) return errc::misuse;
  if (!parts_->by->wants(topic)) return {};
  if (parts_->on->forked()) return errc::forked;
  parts_->subscribed.reserve(parts_->subscribed.size() + 1);
  auto opened = parts_->on->open_pair(detail::listen_request(topic, type, schema, throttle));
  if (!opened) return opened.error();
  parts_->subscribed.emplace_back(parts_->on, **opened);
  return {};
}

status recorder::snapshot(std::string_view cause) {
  if (!parts_ || !parts_->by->is_black_box()) return errc::misuse;
  if (parts_->on->forked()) return errc::forked;
  parts_->by->files().snapshot(cause);
  return {};
}

std::vector<std::string> recorder::unended() const {
  return parts_ ? parts_->by->files().unended() : std::vector<std::string>{};
}

recording_figures recorder::figures() const {
  return parts_ ? parts_->by->files().figures() : recording_figures{};
}

status recorder::flush(rt::duration timeout) {
  if (!parts_) return errc::misuse;
  if (parts_->on->forked()) return errc::forked;
  recording::recorder& files = parts_->by->files();
  if (files.flush(timeout)) return {};
  return files.faulty() ? status{errc::bad_recording} : status{error{errc::timed_out, 0, timeout.count()}};
}

status recorder::close(std::string* why) {
  if (!parts_) return {};
  if (parts_->on->forked()) return errc::forked;
  parts_->subscribed.clear();
  parts_->stop(); // from here on this thread has the feed
  const std::string fault = parts_->by->files().close();
  if (fault.empty()) return {};
  if (why != nullptr) *why = fault;
  return errc::bad_recording;
}

} // namespace rowe
