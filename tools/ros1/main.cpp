// SPDX-License-Identifier: Apache-2.0
// rowe_ros1: a node of ROS 1 that is a client of a rowe endpoint, or of any rosbridge server, and hands
// topics and calls from one to the other. An ordinary process; nothing of it is in the library.
#include <ros/ros.h>

#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../rowe/arguments/command_line.hpp"
#include "../rowe/arguments/limit_options.hpp"
#include "../rowe/console.hpp"
#include "../rowe/interrupt.hpp"
#include "../rowe/network/remote.hpp"
#include "../rowe/output.hpp"
#include "bridge.hpp"

namespace rowe::ros1 {
namespace {

using namespace std::chrono_literals;
using namespace tools;

constexpr rt::duration look_period = 1s;
constexpr std::size_t envelope_bytes = 512; // what stands around a message on the wire: names, and an id
constexpr double master_timeout_s = 2;      // of a registration, when the master goes away meanwhile

struct options {
  remote_place at;
  std::vector<std::string> from_ros;
  std::vector<std::string> to_ros;
  std::vector<std::string> services_from_ros;
  std::vector<std::string> services_to_ros;
  std::vector<std::string> except;
  std::vector<std::string> messages;
  std::optional<rt::duration> timeout;
  bool no_stop = false;
  bool quiet = false;
};

command table_of(options& o) {
  return {
      .verb = "rowe_ros1",
      .examples = {{{"rowe_ros1 ws://127.0.0.1:8080 --from-ros '/camera/*' --from-ros /tf --to-ros /cmd_vel",
                     "until Ctrl-C"},
                    {"rowe_ros1 ws://127.0.0.1:8080 --service-from-ros '/move_base/*'",
                     "services of ROS, for pages"}}},
      .description =
          "A node of ROS 1 that bridges topics and services between ROS and a rowe endpoint, or a rosbridge\n"
          "server. A pattern is as in a shell; `*` matches `/`, too. A topic goes one way, that of its "
          "first\n"
          "publisher. Types are those of publishers; if there is none, write =package/Type after the name.\n"
          "/rowe/stop is a service in ROS, std_srvs/Trigger, which stops the robot at the other end.\n"
          "ROS's own arguments are understood: __name:=NODE, __master:=URI, and $ROS_MASTER_URI.\n",
      .operands = {url_operand(o.at.url)},
      .options = with_remote(
          o.at,
          {
              {"--from-ros", "", "PATTERN", "topics that ROS publishes; again for more", &o.from_ros},
              {"--to-ros", "", "PATTERN", "topics that peers publish; again for more", &o.to_ros},
              {"--service-from-ros", "", "PATTERN", "services that ROS provides", &o.services_from_ros},
              {"--service-to-ros", "", "PATTERN", "services that peers provide", &o.services_to_ros},
              {"--except", "", "PATTERN", "do not bridge what matches this, unless it is named", &o.except},
              {"--messages", "", "FOLDER",
               "more definitions: FOLDER/package/msg/Name.msg (else $ROS_PACKAGE_PATH and /usr/share)",
               &o.messages},
              {"--timeout", "", "TIME", "the timeout of a call from ROS (default 10s)",
               time_span{&o.timeout}},
              {"--no-stop", "", "", "no /rowe/stop in ROS", &o.no_stop},
              {"--quiet", "-q", "", "print errors only", &o.quiet},
          })};
}

// Follows both sides until a signal comes.
void run(remote& connection, bridge& all, const console& to) {
  int master = 0;
  bool missing = false;
  while (!interrupt::seen() && ros::ok()) {
    const auto begin = rt::monotonic_clock::now();
    connection.report();
    const auto graph = look_at_ros();
    if (!graph) {
      if (!missing) to.note("no ROS master answers at ", ros::master::getURI(), "; waiting for it");
      missing = true;
    } else {
      if (master != 0 && master != graph->master) {
        to.note("the ROS master is another one; everything is registered anew");
        all.forget();
      } else if (missing && master != 0) {
        to.note("the ROS master answers again");
      }
      missing = false;
      master = graph->master;
      all.follow(*graph);
    }
    all.report_losses();
    interrupt::sleep_until(begin + look_period);
  }
}

exit_code start(const options& o, bridge_options& how) {
  console to{"rowe_ros1"};
  to.be_quiet(o.quiet);
  const spelled_url url = read_url(o.at.url);
  if (url.url.empty()) return usage_error("rowe_ros1", url.wrong);
  const auto texts = 64U; // of everything that asks and lists
  auto bounds = limits_for("rowe_ros1");
  if (!bounds) return exit_code::usage;
  bounds->handles_max = std::max<std::uint32_t>(bounds->handles_max, topics_max + services_max + texts);
  const std::size_t slots = topics_max * topic_depth + services_max * service_depth * 2 + texts;
  bounds->handle_bytes =
      std::max(bounds->handle_bytes, slots * (bounds->message_bytes_max + std::size_t{4096}));
  bounds->large_slots = std::max<std::uint32_t>(bounds->large_slots, 64);
  endpoint_options options{.limits = *bounds};
  if (const auto end = use(o.at, options, to)) return *end;
  how.bytes_max = bounds->message_bytes_max - envelope_bytes;
  how.timeout = o.timeout.value_or(how.timeout);
  how.stop = !o.no_stop;

  ros::master::setRetryTimeout(ros::WallDuration{master_timeout_s});
  ros::start();
  auto hub = endpoint::connect(url.url, options);
  if (!hub) return cannot_open(url.url, hub.error(), to);
  remote connection{*hub, url.url, to};
  const installed_definitions installed{o.messages};
  {
    bridge all{*hub, how, installed, to};
    run(connection, all, to);
    connection.report();
    all.summarise();
    ros::shutdown(); // ends calls of services that do not answer
  }
  connection.close();
  return exit_code::done;
}

exit_code main(argument_list arguments) {
  options o;
  if (const auto end = read(table_of(o), arguments)) return *end;
  bridge_options how;
  const auto set = [](wanted_names& names, const std::vector<std::string>& from, std::string_view option) {
    const std::string wrong = names.set(from);
    return wrong.empty() ? wrong : joined(option, ": ", wrong);
  };
  for (const std::string& wrong :
       {set(how.topics_from_ros, o.from_ros, "--from-ros"), set(how.topics_to_ros, o.to_ros, "--to-ros"),
        set(how.services_from_ros, o.services_from_ros, "--service-from-ros"),
        set(how.services_to_ros, o.services_to_ros, "--service-to-ros"),
        set(how.except, o.except, "--except")}) {
    if (!wrong.empty()) return usage_error("rowe_ros1", wrong);
  }
  for (const auto& one : how.topics_from_ros.all()) {
    if (one.is_name && how.topics_to_ros.names(one.pattern))
      return usage_error("rowe_ros1",
                         joined(one.pattern, " cannot go both ways: its messages would go round for ever"));
  }
  return start(o, how);
}

} // namespace
} // namespace rowe::ros1

int main(int count, char** words) {
  setenv("ROS_MASTER_URI", "http://localhost:11311", 0); // roscpp ends the program where it is not set
  // Takes ROS's own arguments out of the words.
  ros::init(count, words, "rowe_ros1", ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  return rowe::tools::run_program(count, words, rowe::ros1::main);
}
