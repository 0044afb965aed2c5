// SPDX-License-Identifier: Apache-2.0
#include "texts.hpp"

#include "../console.hpp"
#include "identities.hpp"

namespace rowe::tools {
namespace {

std::string list_of(const std::vector<std::string>& texts) {
  std::string list;
  for (const std::string& one : texts) list.append(list.empty() ? "\"" : ", \"").append(one) += '"';
  return joined("[", list, "]");
}

} // namespace

std::vector<std::string> setup_files() {
  std::vector<std::string> names;
  for (const std::string_view one : {settings_file, certificate_file, key_file, root_file, root_phone_file,
                                     root_key_file, avahi_file, tokens_file})
    names.emplace_back(one);
  return names;
}

// What is written here holds no character that TOML or XML would have to escape: check_robot_name(),
// check_host_name(), is_address().
std::string toml_of(const robot_settings& robot) {
  std::string text = joined("# Settings of the robot ", robot.name, ", made by `rowe setup`.\n",
                            "# rowe serve --config ", settings_file, " reads them.\n\n");
  text += joined("[endpoint]\n", "name = \"", robot.name, "\"        # what the page and `rowe peers` show\n",
                 "address = \"", robot.address, "\"    # 0.0.0.0: all of this machine's networks\n",
                 "port = ", robot.port, "\n");
  if (!robot.hosts.empty()) {
    text += joined("# Names in URLs that it answers to; the certificate has to have them, too.\n",
                   "allow_hosts = ", list_of(robot.hosts), "\n");
  }
  text += joined("\n[tls]\n", "# Files in PEM; names without a slash are beside this file.\n",
                 "certificate = \"", certificate_file, "\"\n", "key = \"", key_file, "\"\n\n");
  text += "# Who may connect, and as what. Only the hash of a token is here; the token was printed once.\n"
          "# observer: sees. driver: also publishes and calls. supervisor: also resets and guards.\n"
          "# peer: another robot or a service. All of them may stop the robot.\n"
          "# `rowe token add NAME ROLE` makes a further one, `rowe token remove NAME` removes one.\n";
  for (const identity& one : robot.identities) text += joined("\n", toml_of(one));
  return text;
}

std::string avahi_service_of(std::string_view name, std::uint16_t port) {
  std::string services;
  for (const std::string_view type : {"_rowe._tcp", "_https._tcp"}) {
    services += joined("  <service>\n"
                       "    <type>",
                       type,
                       "</type>\n"
                       "    <port>",
                       port,
                       "</port>\n"
                       "    <txt-record>path=/</txt-record>\n"
                       "    <txt-record>scheme=https</txt-record>\n"
                       "    <txt-record>name=",
                       name,
                       "</txt-record>\n"
                       "    <txt-record>api=rowe.v1</txt-record>\n"
                       "  </service>\n");
  }
  return joined("<?xml version=\"1.0\" standalone='no'?>\n"
                "<!DOCTYPE service-group SYSTEM \"avahi-service.dtd\">\n"
                "<!-- Announces the robot ",
                name,
                " on the network. To be put into /etc/avahi/services. -->\n"
                "<service-group>\n"
                "  <name>",
                name, "</name>\n", services, "</service-group>\n");
}

} // namespace rowe::tools
