// SPDX-License-Identifier: Apache-2.0
#include "baseline_v1/endpoint.hpp"

#include <algorithm>
#include <cstring>
#include <random>

namespace rowe::baseline_v1 {
namespace {

constexpr std::size_t buffer_bytes = 64 * 1024; // smaller ones cost libwebsockets throughput

clock::time_point after(clock::duration span) { return clock::now() + std::min(span, for_ever); }

// Ids of this process differ from those of one that ran before.
const std::string& nonce() {
  static const std::string drawn = std::to_string(std::random_device{}());
  return drawn;
}

std::string_view text_of(json_object* in, const char* member) {
  json_object* found = nullptr;
  if (json_object_object_get_ex(in, member, &found) == 0) return {};
  return {json_object_get_string(found), static_cast<std::size_t>(json_object_get_string_len(found))};
}

void name_invocation(const object& reply, const object& invocation) {
  const std::string_view id = text_of(invocation.get(), "message_id");
  json_object_object_add(reply.get(), "in_reply_to",
                         json_object_new_string_len(id.data(), static_cast<int>(id.size())));
}

lws_context_creation_info info_of(void* user, const lws_protocols* protocols) {
  lws_context_creation_info info{};
  info.protocols = protocols;
  info.pt_serv_buf_size = buffer_bytes;
  info.gid = -1;
  info.uid = -1;
  info.user = user;
  return info;
}

} // namespace

const lws_protocols endpoint::protocols[] = {{"rowe", callback, 0, buffer_bytes, 0, nullptr, 0},
                                             {nullptr, nullptr, 0, 0, 0, nullptr, 0}};

// ---- set-up

std::unique_ptr<endpoint> endpoint::open_local(int port) {
  std::unique_ptr<endpoint> made{new endpoint};
  return made->open(port) ? std::move(made) : nullptr;
}

std::unique_ptr<endpoint> endpoint::open_remote(const std::string& host, int port) {
  std::unique_ptr<endpoint> made{new endpoint};
  return made->open(CONTEXT_PORT_NO_LISTEN) && made->connect(host, port) ? std::move(made) : nullptr;
}

bool endpoint::open(int port) {
  lws_set_log_level(0, nullptr);
  tokener_ = json_tokener_new();
  expiry_.of = this;
  lws_context_creation_info info = info_of(this, protocols);
  info.port = port;
  info.iface = "127.0.0.1";
  context_ = lws_create_context(&info);
  if (context_ == nullptr || tokener_ == nullptr) return false;
  if (port != CONTEXT_PORT_NO_LISTEN) {
    port_ = lws_get_vhost_listen_port(lws_get_vhost_by_name(context_, "default"));
    service_ = std::thread{[this] { serve(); }};
  }
  return true;
}

// Before the service thread runs: the loop of a client begins with its connection.
bool endpoint::connect(const std::string& host, int port) {
  lws_client_connect_info to{};
  to.context = context_;
  to.address = host.c_str();
  to.host = host.c_str();
  to.origin = host.c_str();
  to.port = port;
  to.path = "/";
  to.protocol = protocols[0].name;
  to.local_protocol_name = protocols[0].name;
  if (lws_client_connect_via_info(&to) == nullptr) return false;
  service_ = std::thread{[this] { serve(); }};
  return true;
}

endpoint::~endpoint() {
  ends_.store(true);
  if (service_.joinable()) {
    lws_cancel_service(context_);
    service_.join();
  }
  lws_sul_cancel(&expiry_.list);
  if (context_ != nullptr) lws_context_destroy(context_);
  if (tokener_ != nullptr) json_tokener_free(tokener_);
}

bool endpoint::wait_peer(clock::duration timeout) {
  std::unique_lock lock{mutex_};
  return peer_came_.wait_until(lock, after(timeout), [&] { return has_peer_; });
}

// ---- user threads

// The text is made here, so that the service thread has less to do, and behind room for the frame's header.
void endpoint::queue(const object& message, clock::time_point expires, notification* sender) {
  std::size_t bytes = 0;
  const char* const text = json_object_to_json_string_length(message.get(), JSON_C_TO_STRING_PLAIN, &bytes);
  outgoing made{std::vector<unsigned char>(LWS_PRE + bytes), sender};
  std::memcpy(made.frame.data() + LWS_PRE, text, bytes);
  const std::lock_guard lock{mutex_};
  outbox_.push(std::move(made), expires);
}

void endpoint::async_send(const object& message, clock::duration ttl) {
  queue(message, after(ttl), nullptr);
  lws_cancel_service(context_);
}

outcome endpoint::queue_and_wait(const object& message, clock::duration ttl) {
  notification sent;
  queue(message, after(ttl), &sent);
  lws_cancel_service(context_);
  std::unique_lock lock{mutex_};
  sent.happened.wait(lock, [&] { return sent.what.has_value(); });
  return *sent.what;
}

outcome endpoint::send(const object& message, clock::duration ttl) { return queue_and_wait(message, ttl); }

void endpoint::async_reply(const object& invocation, const object& with, clock::duration ttl) {
  name_invocation(with, invocation);
  async_send(with, ttl);
}

outcome endpoint::reply(const object& invocation, const object& with, clock::duration ttl) {
  name_invocation(with, invocation);
  return queue_and_wait(with, ttl);
}

object endpoint::receive(clock::duration timeout) {
  const auto until = after(timeout);
  std::unique_lock lock{mutex_};
  if (!arrived_.wait_until(lock, until, [&] { return !inbox_.empty(); })) return nullptr;
  return inbox_.pop();
}

object endpoint::invoke(const object& what, clock::duration timeout) {
  const auto until = after(timeout);
  std::string id;
  waiting_call mine;
  {
    const std::lock_guard lock{mutex_};
    id = nonce() + "." + std::to_string(++invoked_);
    mine.id = id;
    calls_.push_back(&mine);
  }
  json_object_object_add(what.get(), "message_id", json_object_new_string(id.c_str()));
  queue(what, until, nullptr);
  lws_cancel_service(context_);
  std::unique_lock lock{mutex_};
  mine.replied.wait_until(lock, until, [&] { return mine.reply != nullptr; }); // else null, which says so
  calls_.remove(&mine);
  return std::move(mine.reply);
}

// ---- the service thread

// Under the mutex: what is told lives on the stack of the thread that waits.
void endpoint::tell(notification* sender, outcome what) {
  if (sender == nullptr) return;
  sender->what = what;
  sender->happened.notify_one();
}

void endpoint::serve() {
  while (!ends_.load()) lws_service(context_, 0); // waits until something happens
  std::unique_lock lock{mutex_};
  while (!outbox_.empty()) tell(outbox_.pop().sender, outcome::closed);
}

int endpoint::callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t bytes) {
  auto* const of = static_cast<endpoint*>(lws_context_user(lws_get_context(wsi)));
  if (of == nullptr) return 0; // while the context is made
  return of->on_event(wsi, reason, {static_cast<const char*>(in), in == nullptr ? 0 : bytes});
}

int endpoint::on_event(lws* wsi, lws_callback_reasons reason, std::string_view in) {
  switch (reason) {
  case LWS_CALLBACK_ESTABLISHED:
  case LWS_CALLBACK_CLIENT_ESTABLISHED: return join(wsi);
  case LWS_CALLBACK_RECEIVE:
  case LWS_CALLBACK_CLIENT_RECEIVE: take_piece(wsi, in); return 0;
  case LWS_CALLBACK_SERVER_WRITEABLE:
  case LWS_CALLBACK_CLIENT_WRITEABLE: return write_next(wsi);
  case LWS_CALLBACK_CLOSED:
  case LWS_CALLBACK_CLIENT_CLOSED: leave(wsi); return 0;
  case LWS_CALLBACK_EVENT_WAIT_CANCELLED: // somebody has put something into the outbox
    if (peer_ != nullptr) lws_callback_on_writable(peer_);
    arm_expiry();
    return 0;
  default: return lws_callback_http_dummy(wsi, reason, nullptr, const_cast<char*>(in.data()), in.size());
  }
}

int endpoint::join(lws* wsi) {
  if (peer_ != nullptr) return -1; // one peer at a time
  peer_ = wsi;
  coming_.clear();
  lws_callback_on_writable(wsi);
  const std::lock_guard lock{mutex_};
  has_peer_ = true;
  peer_came_.notify_all();
  return 0;
}

void endpoint::leave(lws* wsi) {
  if (peer_ != wsi) return;
  peer_ = nullptr;
  const std::lock_guard lock{mutex_};
  has_peer_ = false;
}

void endpoint::take_piece(lws* wsi, std::string_view piece) {
  const bool complete = lws_is_final_fragment(wsi) != 0 && lws_remaining_packet_payload(wsi) == 0;
  if (!complete || !coming_.empty()) coming_ += piece;
  if (!complete) return;
  const std::string_view whole = coming_.empty() ? piece : std::string_view{coming_};
  json_tokener_reset(tokener_);
  take(object{json_tokener_parse_ex(tokener_, whole.data(), static_cast<int>(whole.size()))});
  coming_.clear();
}

// To the invocation that it replies to, or to whoever receives.
void endpoint::take(object message) {
  if (message == nullptr) return; // no JSON
  const std::string_view id = text_of(message.get(), "in_reply_to");
  const std::lock_guard lock{mutex_};
  if (id.empty()) {
    inbox_.push(std::move(message), clock::time_point::max());
    arrived_.notify_one();
    return;
  }
  for (waiting_call* const one : calls_) {
    if (one->id != id) continue;
    one->reply = std::move(message);
    one->replied.notify_one(); // under the mutex: it lives on the stack of the one who waits
    return;
  }
}

int endpoint::write_next(lws* wsi) {
  const auto now = clock::now();
  outgoing next;
  bool more = false;
  {
    const std::lock_guard lock{mutex_};
    expire(now);
    if (outbox_.empty()) return 0;
    next = outbox_.pop();
    more = !outbox_.empty();
  }
  const std::size_t bytes = next.frame.size() - LWS_PRE;
  const int written = lws_write(wsi, next.frame.data() + LWS_PRE, bytes, LWS_WRITE_TEXT);
  if (next.sender != nullptr) {
    const std::lock_guard lock{mutex_};
    tell(next.sender, written < 0 ? outcome::closed : outcome::sent);
  }
  if (written < 0) return -1;
  if (more) lws_callback_on_writable(wsi);
  return 0;
}

void endpoint::expire(clock::time_point now) {
  outbox_.expire(now, [](outgoing& gone) { tell(gone.sender, outcome::expired); });
  inbox_.expire(now, [](object&) {});
}

void endpoint::expiry_is_due(lws_sorted_usec_list_t* due) {
  endpoint& of = *reinterpret_cast<timer*>(due)->of;
  of.expiry_armed_ = clock::time_point::max();
  {
    const std::lock_guard lock{of.mutex_};
    of.expire(clock::now());
  }
  of.arm_expiry();
}

// Only for what is earlier than what the timer is set to: it looks again then.
void endpoint::arm_expiry() {
  clock::time_point earliest;
  {
    const std::lock_guard lock{mutex_};
    earliest = outbox_.earliest_expiry();
  }
  if (earliest >= expiry_armed_) return;
  expiry_armed_ = earliest;
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(earliest - clock::now());
  lws_sul_schedule(context_, 0, &expiry_.list, expiry_is_due, std::max<lws_usec_t>(left.count() + 1, 1));
}

} // namespace rowe::baseline_v1
