// SPDX-License-Identifier: Apache-2.0
#include "master.hpp"

#include <netdb.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <sys/socket.h>
#include <unistd.h>
#include <xmlrpcpp/XmlRpcException.h>

#include <cstdint>
#include <cstring>
#include <vector>

namespace rowe::ros1 {
namespace {

using XmlRpc::XmlRpcValue;

constexpr time_t probe_seconds = 2;
constexpr std::uint32_t header_bytes_max = 64 * 1024;

std::optional<XmlRpcValue> ask(const char* what, const XmlRpcValue* more = nullptr) {
  XmlRpcValue request;
  request[0] = ros::this_node::getName();
  if (more != nullptr) request[1] = *more;
  XmlRpcValue response;
  XmlRpcValue answer;
  if (!ros::master::execute(what, request, response, answer, false)) return std::nullopt;
  return answer;
}

bool is_list(XmlRpcValue& value, int at_least) {
  return value.getType() == XmlRpcValue::TypeArray && value.size() >= at_least;
}

// Whether nodes other than this one are among [name, [node, ...]].
bool has_others(XmlRpcValue& entry) {
  XmlRpcValue& nodes = entry[1];
  for (int i = 0; i < nodes.size(); ++i) {
    if (static_cast<std::string>(nodes[i]) != ros::this_node::getName()) return true;
  }
  return false;
}

// A socket that is closed at the end, to a host and port.
class connected_socket {
 public:
  connected_socket(const std::string& host, const std::string& port) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* all = nullptr;
    if (getaddrinfo(host.c_str(), port.c_str(), &hints, &all) != 0) return;
    for (const addrinfo* one = all; one != nullptr && fd_ < 0; one = one->ai_next) {
      const int fd = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
      if (fd < 0) continue;
      const timeval limit{probe_seconds, 0};
      setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
      setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
      if (connect(fd, one->ai_addr, one->ai_addrlen) == 0) {
        fd_ = fd;
      } else {
        close(fd);
      }
    }
    freeaddrinfo(all);
  }
  connected_socket(const connected_socket&) = delete;
  connected_socket& operator=(const connected_socket&) = delete;
  ~connected_socket() {
    if (fd_ >= 0) close(fd_);
  }

  bool send_all(const std::string& bytes) const {
    const auto all = static_cast<ssize_t>(bytes.size());
    return fd_ >= 0 && ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == all;
  }
  bool receive_all(char* into, std::size_t count) const {
    return fd_ >= 0 && ::recv(fd_, into, count, MSG_WAITALL) == static_cast<ssize_t>(count);
  }

 private:
  int fd_ = -1;
};

void append_length(std::string& to, std::size_t length) {
  const auto value = static_cast<std::uint32_t>(length);
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  to.append(bytes, sizeof bytes);
}

} // namespace

std::optional<ros_graph> look_at_ros() try {
  auto pid = ask("getPid");
  auto state = pid ? ask("getSystemState") : std::nullopt;
  auto types = state ? ask("getTopicTypes") : std::nullopt;
  if (!types || pid->getType() != XmlRpcValue::TypeInt || !is_list(*state, 3)) return std::nullopt;
  ros_graph graph;
  graph.master = static_cast<int>(*pid);
  for (int i = 0; i < types->size(); ++i)
    graph.types[static_cast<std::string>((*types)[i][0])] = static_cast<std::string>((*types)[i][1]);
  XmlRpcValue& published = (*state)[0];
  for (int i = 0; i < published.size(); ++i) {
    if (!has_others(published[i])) continue;
    const auto name = static_cast<std::string>(published[i][0]);
    if (const auto type = graph.types.find(name); type != graph.types.end())
      graph.topics[name] = type->second;
  }
  XmlRpcValue& services = (*state)[2];
  for (int i = 0; i < services.size(); ++i) {
    if (!has_others(services[i])) continue;
    XmlRpcValue name = services[i][0];
    if (auto uri = ask("lookupService", &name); uri && uri->getType() == XmlRpcValue::TypeString)
      graph.services[static_cast<std::string>(name)] = static_cast<std::string>(*uri);
  }
  return graph;
} catch (const XmlRpc::XmlRpcException&) { // the answer has another form than a master's
  return std::nullopt;
}

std::optional<std::string> type_of_service(const std::string& name, const std::string& uri) {
  constexpr std::string_view scheme = "rosrpc://";
  const std::size_t colon = uri.rfind(':');
  if (!uri.starts_with(scheme) || colon < scheme.size()) return std::nullopt;
  const connected_socket to{uri.substr(scheme.size(), colon - scheme.size()), uri.substr(colon + 1)};

  // A header whose `probe` asks for nothing but the provider's header.
  std::string fields;
  for (const std::string& field : {std::string{"probe=1"}, std::string{"md5sum=*"},
                                   "callerid=" + ros::this_node::getName(), "service=" + name}) {
    append_length(fields, field.size());
    fields += field;
  }
  std::string header;
  append_length(header, fields.size());
  std::uint32_t length = 0;
  if (!to.send_all(header + fields) || !to.receive_all(reinterpret_cast<char*>(&length), sizeof length) ||
      length > header_bytes_max)
    return std::nullopt;
  std::string answer(length, '\0');
  if (!to.receive_all(answer.data(), length)) return std::nullopt;
  for (std::string_view rest = answer; rest.size() >= sizeof length;) {
    std::memcpy(&length, rest.data(), sizeof length);
    rest.remove_prefix(sizeof length);
    if (length > rest.size()) break;
    const std::string_view field = rest.substr(0, length);
    if (field.starts_with("type=")) return std::string{field.substr(5)};
    rest.remove_prefix(length);
  }
  return std::nullopt;
}

} // namespace rowe::ros1
