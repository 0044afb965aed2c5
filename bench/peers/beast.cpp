// SPDX-License-Identifier: Apache-2.0
// A server of bench/peers (peers.hpp) on Boost.Beast. One client at a time is served by blocking calls, which
// are its fastest; everybody (fan_out) asynchronously, each connection writing one shared text; and so is
// echo with --busy, where the context is asked for events without waiting.
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility> // Boost 1.74 forgets it

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include "arguments.hpp"

namespace rowe::bench {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using stream = websocket::stream<tcp::socket>;
using error_code = boost::system::error_code;

// The client that goes away ends it, by an exception.
void serve(stream connection, serving mode) {
  connection.accept();
  beast::flat_buffer message;
  for (std::size_t count = 1;; ++count) {
    connection.read(message);
    connection.text(connection.got_text());
    if (mode == serving::echo) connection.write(message.data());
    while (mode == serving::flood) connection.write(message.data());
    if (mode == serving::sink && message.size() == 1) connection.write(asio::buffer(std::to_string(count)));
    message.consume(message.size());
  }
}

class member : public std::enable_shared_from_this<member> {
 public:
  member(tcp::socket&& socket, serving mode) : connection_{std::move(socket)}, mode_{mode} {}

  void begin() {
    connection_.async_accept([self = shared_from_this()](error_code failed) {
      if (failed) return;
      self->connection_.text(true);
      everybody.insert(self.get());
      self->read();
    });
  }
  ~member() { everybody.erase(this); }

 private:
  inline static std::set<member*> everybody;

  void read() {
    connection_.async_read(message_, [self = shared_from_this()](error_code failed, std::size_t) {
      if (failed) return;
      const auto text = std::make_shared<const std::string>(beast::buffers_to_string(self->message_.data()));
      self->message_.consume(self->message_.size());
      if (self->mode_ == serving::echo)
        self->write(text);
      else
        for (member* const to : everybody) to->write(text);
      self->read();
    });
  }
  // Before the last one was written nobody asks for another.
  void write(std::shared_ptr<const std::string> text) {
    connection_.async_write(asio::buffer(*text),
                            [self = shared_from_this(), text](error_code, std::size_t) {});
  }

  stream connection_;
  const serving mode_;
  beast::flat_buffer message_;
};

void run(const peer_arguments& how) {
  asio::io_context context{1};
  tcp::acceptor acceptor{context, {asio::ip::address_v4::loopback(), how.port}};
  std::function<void()> accept = [&] {
    acceptor.async_accept([&](error_code failed, tcp::socket socket) {
      if (failed) return;
      socket.set_option(tcp::no_delay{true});
      std::make_shared<member>(std::move(socket), how.mode)->begin();
      accept();
    });
  };
  if (how.mode == serving::fan_out || how.busy) {
    accept();
    for (;;) how.busy ? context.poll() : context.run();
  }
  for (;;) {
    tcp::socket socket = acceptor.accept();
    socket.set_option(tcp::no_delay{true});
    std::thread{[mode = how.mode, connection = stream{std::move(socket)}]() mutable {
      try {
        serve(std::move(connection), mode);
      } catch (const boost::system::system_error&) { // gone
      }
    }}.detach();
  }
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) { rowe::bench::run(rowe::bench::arguments_of(count, arguments)); }
