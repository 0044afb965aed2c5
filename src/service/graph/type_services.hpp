// SPDX-License-Identifier: Apache-2.0
// The services that say what types look like, of the topics and services for which a handle of this process
// has a schema, of its parameters, and of the endpoint's own topics and services: /rowe/types for programs
// that make declarations or forms of them, and rosapi's for ROS's clients. A peer learns nothing of what its
// role may not subscribe to, call or read. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <string_view>

#include <rowe/schema.hpp>

#include "service/calls/call_completion.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/parameters/parameters.hpp"
#include "service/state/core_state.hpp"
#include "service/threads/stop_rules.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/request.hpp"

namespace rowe::service {

struct type_services_needs {
  core_state& state_;
  const stop_rules& stop_rules_;
  outbox& outbox_;
  call_completion& call_completion_;
  parameters& parameters_;
};

class type_services : type_services_needs {
 public:
  explicit type_services(const type_services_needs& parts) noexcept : type_services_needs{parts} {}

  // Whether the service of this full name is one of them.
  static bool answers(std::string_view service) noexcept;
  // Answers the call, and so ends it. `by`: the peer, if it has a role; null: whoever asks sees everything.
  void answer(call_index call, std::string_view service, const wire::call_args& what,
              const connection* by) noexcept;

 private:
  enum class side_of_call : std::uint8_t { request, answer };
  struct pages;

  template <class Write>
  slot_id compose(bool& too_large, const Write& write) noexcept;
  void complete(call_index call, slot_id slot, bool too_large, std::string_view what) noexcept;
  void answer_page(call_index call, const wire::call_args& what, const connection* by) noexcept;
  void answer_details(call_index call, std::string_view service, std::string_view type,
                      const connection* by) noexcept;
  bool sees(topic_id topic, const connection* by) const noexcept;
  bool calls(std::string_view service, const connection* by) const noexcept;
  bool has_own(const own_service_type& own, const connection* by) const noexcept;
  const schema_description* find_message(std::string_view type, const connection* by) const noexcept;
  const schema_description* find_inside(std::string_view type, const connection* by) const noexcept;
  const schema_description* find_call(std::string_view type, side_of_call which,
                                      const connection* by) const noexcept;
};

} // namespace rowe::service
