// SPDX-License-Identifier: Apache-2.0
// A server of bench/peers (peers.hpp) on websocketpp: its configuration without logs, locks (there is one
// thread) and permessage-deflate. What goes to everybody is one prepared message.
#include <memory>
#include <set>
#include <string>

#include <websocketpp/concurrency/none.hpp>
#include <websocketpp/config/asio_no_tls.hpp>
#include <websocketpp/logger/stub.hpp>
#include <websocketpp/server.hpp>

#include "arguments.hpp"

namespace rowe::bench {
namespace {

namespace asio = websocketpp::lib::asio;

struct bare : websocketpp::config::asio {
  using concurrency_type = websocketpp::concurrency::none;
  using alog_type = websocketpp::log::stub;
  using elog_type = websocketpp::log::stub;
  struct transport_config : websocketpp::config::asio::transport_config {
    using concurrency_type = bare::concurrency_type;
    using alog_type = bare::alog_type;
    using elog_type = bare::elog_type;
    static const bool enable_multithreading = false;
  };
  using transport_type = websocketpp::transport::asio::endpoint<transport_config>;
};

using server = websocketpp::server<bare>;
using connection = server::connection_ptr;
using handle = websocketpp::connection_hdl;

constexpr std::size_t buffered_max = 64 * 1024;

class peer {
 public:
  explicit peer(const peer_arguments& how) : how_{how} {
    server_.init_asio();
    server_.set_reuse_addr(true);
    server_.set_tcp_post_init_handler([this](handle who) {
      server_.get_con_from_hdl(who)->get_raw_socket().set_option(asio::ip::tcp::no_delay{true});
    });
    server_.set_open_handler([this](handle who) {
      everybody_.insert(who);
      count_ = 0;
    });
    server_.set_close_handler([this](handle who) { everybody_.erase(who); });
    server_.set_fail_handler([this](handle who) { everybody_.erase(who); });
    server_.set_message_handler([this](handle who, server::message_ptr message) { take(who, message); });
  }

  int run() {
    server_.listen(asio::ip::tcp::endpoint{asio::ip::address_v4::loopback(), how_.port});
    server_.start_accept();
    if (how_.busy)
      for (;;) server_.poll();
    server_.run();
    return 0;
  }

 private:
  void take(handle who, const server::message_ptr& message) {
    ++count_;
    const connection from = server_.get_con_from_hdl(who);
    switch (how_.mode) {
    case serving::echo: (void)from->send(message); break;
    case serving::fan_out:
      for (const handle& to : everybody_)
        (void)server_.get_con_from_hdl(to)->send(message->get_payload(), message->get_opcode());
      break;
    case serving::sink:
      if (message->get_payload().size() == 1) (void)from->send(std::to_string(count_));
      break;
    case serving::flood: flood(from, message);
    }
  }
  void flood(const connection& to, const server::message_ptr& message) {
    while (to->get_buffered_amount() < buffered_max)
      if (to->send(message->get_payload(), message->get_opcode())) return;
    server_.get_io_service().post([this, to, message] { flood(to, message); });
  }

  const peer_arguments how_;
  server server_;
  std::set<handle, std::owner_less<handle>> everybody_;
  std::size_t count_ = 0;
};

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  return rowe::bench::peer{rowe::bench::arguments_of(count, arguments)}.run();
}
