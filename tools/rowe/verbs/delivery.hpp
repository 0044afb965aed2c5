// SPDX-License-Identifier: Apache-2.0
// What became of what `rowe pub` has sent, as far as the server says it: whether anybody listens there, and
// whether a message was too long for it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/endpoint.hpp>

#include "../network/remote.hpp"

namespace rowe::tools {

// Whether somebody has subscribed to the topic. Errors: no_service, refused (the server does not say it),
// timed_out, peer_lost and the like (there was no answer). A server carries out what it is sent in its order,
// so any answer, even one that says no, proves that it has dealt with what was sent before.
result<bool> has_subscribers(endpoint& via, const std::string& topic, rt::duration timeout, watcher& wait);

// Whether the server has answered, whatever it said.
bool is_answer(const result<bool>& asked) noexcept;

// Who refused a message of so many bytes, and by which limit, where `said`, the server's own words, names
// one. Empty: it does not.
std::string refusal_of(std::string_view server, std::size_t bytes, std::string_view said);

// How many bytes a message may have there, as `said`: the limit that it names. Nothing: it names none.
std::optional<std::uint64_t> bytes_taken_by_server(std::string_view said) noexcept;

} // namespace rowe::tools
