// SPDX-License-Identifier: Apache-2.0
// A server of bench/peers (peers.hpp) on libwebsockets as it is documented: everything is written in the
// writable callback, until the pipe is choked; what goes to everybody is one text that each connection's
// callback writes. --busy services without waiting, by a negative timeout.
#include <cstring>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <libwebsockets.h>

#include "arguments.hpp"

namespace rowe::bench {
namespace {

// A text with the room in front of it that lws_write() asks for.
class outgoing {
 public:
  void set(std::string_view text) {
    buffer_.assign(LWS_PRE, '\0');
    buffer_.append(text);
  }
  bool empty() const { return buffer_.size() <= LWS_PRE; }
  bool write(lws* to) {
    const std::size_t bytes = buffer_.size() - LWS_PRE;
    return lws_write(to, reinterpret_cast<unsigned char*>(buffer_.data()) + LWS_PRE, bytes, LWS_WRITE_TEXT) >=
           0;
  }

 private:
  std::string buffer_;
};

serving mode;
outgoing text; // of the last message: only one is under way
std::size_t taken = 0;
bool in_pieces = false;
std::set<lws*> everybody;

void take(lws* from, std::string_view message) {
  // In a flood they come in pieces, and are only counted.
  const bool more = lws_remaining_packet_payload(from) != 0;
  const bool whole = !std::exchange(in_pieces, more);
  if (more) return;
  ++taken;
  if (mode == serving::sink) {
    if (!whole || message.size() != 1) return;
    text.set(std::to_string(taken));
  } else {
    text.set(message);
  }
  if (mode != serving::fan_out) {
    lws_callback_on_writable(from);
    return;
  }
  for (lws* const to : everybody) lws_callback_on_writable(to);
}

// False when the connection is broken.
bool write(lws* to) {
  if (text.empty()) return true;
  do {
    if (!text.write(to)) return false;
  } while (mode == serving::flood && lws_send_pipe_choked(to) == 0);
  if (mode == serving::flood) lws_callback_on_writable(to);
  return true;
}

int callback(lws* connection, lws_callback_reasons why, void*, void* in, std::size_t bytes) {
  if (why == LWS_CALLBACK_ESTABLISHED) {
    everybody.insert(connection);
    text.set("");
    taken = 0;
    in_pieces = false;
  }
  if (why == LWS_CALLBACK_CLOSED) everybody.erase(connection);
  if (why == LWS_CALLBACK_RECEIVE) take(connection, {static_cast<const char*>(in), bytes});
  if (why == LWS_CALLBACK_SERVER_WRITEABLE && !write(connection)) return -1;
  return 0;
}

int run(const peer_arguments& how) {
  mode = how.mode;
  lws_set_log_level(0, nullptr);
  lws_protocols protocols[2] = {};
  protocols[0].name = "bench";
  protocols[0].callback = callback;
  protocols[0].rx_buffer_size = 64 * 1024;
  lws_context_creation_info info{};
  info.port = how.port;
  info.iface = "127.0.0.1";
  info.protocols = protocols;
  lws_context* const context = lws_create_context(&info);
  if (context == nullptr) return 1;
  while (lws_service(context, how.busy ? -1 : 0) >= 0) continue;
  return 0;
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  return rowe::bench::run(rowe::bench::arguments_of(count, arguments));
}
