// SPDX-License-Identifier: Apache-2.0
#include "services.hpp"

#include <ros/advertise_service_options.h>
#include <ros/service_callback_helper.h>

#include <chrono>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "../rowe/console.hpp"
#include "../rowe/text/json_values.hpp"
#include "convert.hpp"
#include "raw_message.hpp"

namespace rowe::ros1 {
namespace {

using namespace std::chrono_literals;
using tools::joined;
using tools::printable;

constexpr rt::duration look_period = 100ms;
constexpr rt::duration stop_timeout = 2s;

class helper : public ros::ServiceCallbackHelper {
 public:
  explicit helper(ros_service::handler how) : how_{std::move(how)} {}

  bool call(ros::ServiceCallbackHelperCallParams& call) override {
    raw_message request;
    ros::serialization::deserializeMessage(call.request, request);
    const auto from = call.connection_header->find("callerid");
    const auto answer =
        how_(from == call.connection_header->end() ? std::string{} : from->second, request.bytes);
    // roscpp hands a caller the reason of an exception only; one that returns false has none.
    if (!answer.ok) throw std::runtime_error{answer.why};
    call.response = ros::serialization::serializeServiceResponse(true, raw_message{answer.bytes});
    return true;
  }

 private:
  ros_service::handler how_;
};

} // namespace

service_from_ros::service_from_ros(std::string name, service_type type, responder<json_text, json_text> to,
                                   std::size_t bytes_max)
    : name_{std::move(name)},
      type_{std::move(type)},
      to_{std::move(to)},
      bytes_max_{bytes_max},
      thread_{[this] { answer(); }} {}

service_from_ros::~service_from_ros() {
  over_ = true;
  thread_.join();
}

void service_from_ros::answer() {
  while (!over_) {
    auto call = to_.next(look_period);
    if (!call) {
      if (call.code() == errc::closed) break;
      continue;
    }
    std::string json;
    const std::string why = answer_to(call->json(), json);
    status done;
    if (why.empty()) {
      done = to_.reply(*call, json);
    } else {
      counted_.because(why);
      done = to_.refuse(*call, why);
    }
    ++(done && why.empty() ? counted_.passed : counted_.failed);
  }
  ended_ = true;
}

// Empty, or why there is no answer.
std::string service_from_ros::answer_to(json_value request, std::string& json) {
  raw_message asked;
  std::string why;
  switch (from_json(*type_.request, request, asked.bytes, bytes_max_, why)) {
  case converted::done: break;
  case converted::wrong: return why;
  case converted::too_big: return joined("the request is longer than ", bytes_max_, " bytes of ROS");
  }
  ros::ServiceClientOptions options;
  options.service = name_;
  options.md5sum = type_.md5;
  raw_message answered;
  ros::ServiceClient client = ros::NodeHandle{}.serviceClient(options);
  if (!client.call(asked, answered, type_.md5))
    return joined("the ROS service ", name_, " did not answer, or refused the call");
  switch (to_json(*type_.response, answered.bytes, json, bytes_max_)) {
  case converted::done: return {};
  case converted::wrong: return joined("what the ROS service ", name_, " answered is no ", type_.name);
  case converted::too_big: return joined("the answer is longer than ", bytes_max_, " bytes of JSON");
  }
  return {};
}

ros_service::ros_service(ros::NodeHandle& node, const std::string& name, const service_type& type,
                         handler how) {
  ros::AdvertiseServiceOptions options;
  options.service = name;
  options.md5sum = type.md5;
  options.datatype = type.name;
  options.req_datatype = type.request->name;
  options.res_datatype = type.response->name;
  options.helper = boost::make_shared<helper>(std::move(how));
  options.callback_queue = &queue_;
  server_ = node.advertiseService(options);
  spinner_.start();
}

ros_service::~ros_service() {
  server_.shutdown();
  spinner_.stop();
}

service_to_ros::service_to_ros(ros::NodeHandle& node, const std::string& name, service_type type,
                               caller<json_text, json_text> from, std::size_t bytes_max, rt::duration timeout)
    : type_{std::move(type)},
      from_{std::move(from)},
      bytes_max_{bytes_max},
      timeout_{timeout},
      server_{node, name, type_, [this](const std::string&, const std::string& request) {
                auto answer = ask(request);
                ++(answer.ok ? counted_.passed : counted_.failed);
                if (!answer.ok) counted_.because(answer.why);
                return answer;
              }} {}

ros_service::answer service_to_ros::ask(const std::string& request) {
  std::string json;
  switch (to_json(*type_.request, request, json, bytes_max_)) {
  case converted::done: break;
  case converted::wrong: return {false, {}, "the request is no " + type_.name};
  case converted::too_big:
    return {false, {}, joined("the request is longer than ", bytes_max_, " bytes of JSON")};
  }
  const auto reply = from_.call(json, timeout_);
  if (!reply) {
    const std::string_view why = from_.refusal();
    return {false, {}, why.empty() ? reply.error().message() : printable(why)};
  }
  ros_service::answer answer;
  const auto done = from_json(*type_.response, reply->json(), answer.bytes, bytes_max_, answer.why);
  answer.ok = done == converted::done;
  if (done == converted::too_big)
    answer.why = joined("the answer is longer than ", bytes_max_, " bytes of ROS");
  return answer;
}

namespace {

const service_type& trigger() {
  static const service_type type = [] {
    std::string why;
    const definition_source none = [](const std::string&) { return std::optional<std::string>{}; };
    return *read_service("std_srvs/Trigger", "---\nbool success\nstring message\n", none, why);
  }();
  return type;
}

} // namespace

stop_from_ros::stop_from_ros(ros::NodeHandle& node, caller<json_text, json_text> stop)
    : stop_{std::move(stop)},
      server_{node, "/rowe/stop", trigger(),
              [this](const std::string& who, const std::string&) { return this->stop(who); }} {}

ros_service::answer stop_from_ros::stop(const std::string& who) {
  const std::string source = printable(who).substr(0, 60);
  const auto reply = stop_.call(
      joined("{\"source\":", tools::json_string_of(source), R"(,"reason":"called in ROS"})"), stop_timeout);
  bool success = false;
  std::string message;
  if (!reply) {
    const std::string_view why = stop_.refusal();
    message =
        joined("NOT stopped, as far as is known: ", why.empty() ? reply.error().message() : printable(why));
  } else {
    const bool stopped = reply->find("state") && reply->find("state")->says("stopped");
    const auto observed = reply->find("observed_ns");
    success = stopped && observed && observed->kind() != json_kind::null;
    message = success   ? "stopped; its loops have acknowledged"
              : stopped ? "the stop was accepted, but not acknowledged by its loops"
                        : joined("NOT stopped: ", printable(reply->value()));
  }
  ++(success ? counted_.passed : counted_.failed);
  if (!success) counted_.because(message);
  const auto length = static_cast<std::uint32_t>(message.size());
  std::string bytes(1 + sizeof length, '\0');
  bytes[0] = success ? 1 : 0;
  std::memcpy(bytes.data() + 1, &length, sizeof length);
  return {true, bytes + message, {}};
}

} // namespace rowe::ros1
