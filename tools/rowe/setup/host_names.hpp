// SPDX-License-Identifier: Apache-2.0
// What a robot is called, and what may be called so: the names and addresses in its certificate, and those
// that its root may vouch for.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

struct host_names {
  std::vector<std::string> names;     // of DNS and mDNS
  std::vector<std::string> addresses; // numeric, without brackets or zone
};

// A certificate's common name has 64 characters; ours has some before the robot's name.
inline constexpr std::size_t robot_name_bytes_max = 48;

// What is wrong with the name of a robot, which is a label of DNS; empty: nothing.
std::string check_robot_name(std::string_view name);

// What is wrong with a name under which a robot is to be reached; empty: nothing. Refuses what may be a
// top-level domain: the root would vouch for all names in it.
std::string check_host_name(std::string_view name);

// Whether the address is in one of the ranges that every root of ours may vouch for.
bool is_private(const std::string& address) noexcept;

// This machine's first name, such as "ang-01" of "ang-01.lab.example"; empty if it has none.
std::string own_name();

// How this machine is called in mDNS, where Avahi announces it: "ang-01.local".
std::string own_local_name();

// localhost, NAME.local, the machine's own names, and the further ones given, each once; every address of the
// machine but link-local ones, which need a zone.
host_names names_of_robot(std::string_view name, const std::vector<std::string>& further);

// The machine's addresses alone, and loopback's.
std::vector<std::string> own_addresses();

// Where others reach what listens at an address, as a URL has it; empty if nowhere.
std::string host_for_others(const std::string& listening);

// What a root may vouch for, in the words of OpenSSL's name constraints: the local domain, private ranges,
// and what of `robot` is outside of them. So a new address in a private network needs no new root.
std::string name_constraints(const host_names& robot);

} // namespace rowe::tools
