// SPDX-License-Identifier: Apache-2.0
// The options of endpoints and topics. Times are durations; 0 and negative values mean what each line says.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/access.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/tls.hpp>

namespace rowe {

using duration = rt::duration;
using time_point = rt::time_point;

// How the service thread waits for the next thing to do. Figures are in docs/real-time.md.
enum class idle : std::uint8_t {
  poll,  // in the kernel, for sockets, at most `poll_period`: inbound is immediate, outbound at most that old
  spin,  // never, but it yields where the kernel would otherwise take a SCHED_FIFO thread off its core
  wake,  // in the kernel, until there is something: then a handle that hands something over while the service
         // thread sleeps wakes it, which costs its own thread one write to an eventfd
  phase, // in the kernel, until shortly before a topic's next value is due by its `period`; then awake until
         // it has come, and for answers to calls, for at most 8 ms of any 100 ms. The rest waits as under
         // `poll`
};

// The kind of WebSocket that the peers of an endpoint speak. Hop is Inria's language for the Web, and Hop
// programs know only text frames. So they are sent no pings and no close frames, there is no subprotocol,
// and messages have at most 65 535 bytes. A silent Hop program is not disconnected (see docs/wire.md).
enum class websocket_profile : std::uint8_t {
  standard, // exactly RFC 6455
  hop,      // Hop of 2015 and later
  hop_2014, // Hop of May 2014, which neither masks its frames nor can read masked ones
};

// How long the loop, or the service thread, may be silent where the options leave it open. The scheduling of
// that thread decides. No ordinary program keeps a thread of real-time priority from its core. An ordinary
// thread waits its turn: a browser that starts on the same cores can keep it away for more than 100 ms.
constexpr duration loop_timeout_default(bool real_time) noexcept {
  return std::chrono::milliseconds{real_time ? 100 : 500};
}
constexpr duration service_timeout_default(bool real_time) noexcept {
  return std::chrono::milliseconds{real_time ? 50 : 250};
}

// The stop of an endpoint; in use from its first stop_latch on. See docs/stop.md.
struct stop_options {
  // A guard that is silent for this long stops; 20 ms to 60 s.
  duration guard_timeout = std::chrono::milliseconds{500};
  // How often guards get the state; 1 ms to guard_timeout / 2.
  duration tick = std::chrono::milliseconds{20};
  // Loops stop when the service thread is silent for this long; 2 ms to 10 s. More than a loop keeps the
  // service thread from its core. 0: 50 ms if the service thread was granted SCHED_FIFO, else 250 ms.
  duration service_timeout = {};
  duration observe_timeout = std::chrono::milliseconds{50}; // who asks for a stop is answered within it, even
                                                            // if no loop acknowledged; 1 ms to 10 s
  bool unguarded = false; // the robot may move without any guard; reported to everyone
};

// What an endpoint is opened with.
struct endpoint_options {
  // The service thread.
  idle idle_policy = idle::poll;
  duration poll_period = std::chrono::microseconds{250}; // of idle::poll and phase; 50 us to 10 ms
  int service_cpu = -1;                                  // the core it is pinned to; -1: any
  int service_priority = 0;                              // its SCHED_FIFO priority; 0: an ordinary thread

  // Peers.
  std::string name = {}; // reported to them; empty: the host's name
  bool relay = false;    // a hub: what one peer publishes reaches every peer that subscribed
  duration ping_period = std::chrono::seconds{3};         // one that is silent this long is pinged
  duration silence_max = std::chrono::seconds{8};         // and disconnected when it is silent this long
  duration message_time_max = std::chrono::seconds{5};    // from a message's first byte to its last
  duration stats_period = std::chrono::milliseconds{100}; // of the topic /rowe/stats; 100 ms or more
  rowe::limits limits = {};
  stop_options stop = {};

  // Plain messages and calls (rowe::lane, endpoint::receive and the like).
  websocket_profile profile = websocket_profile::standard;
  duration inbound_ttl = rt::for_ever; // what is not taken within this time is dropped; a peer's call ends
                                       // if it is not answered within it
  duration call_timeout = std::chrono::seconds{30}; // of a peer's call that names none; 1 ms or more
  bool plain_unasked = false; // plain messages also go to peers that never used the plain codec
  bool answers_any = false;   // calls that no handle serves wait for receive() from the start, not only once
                              // it was called

  // Encryption; see tls.hpp.
  tls_options tls = {};

  // endpoint::listen only.
  std::string address = "127.0.0.1"; // numeric; beyond loopback only with `tls` and with
                                     // identities in `access`, or with `insecure`
  std::uint16_t port = 8080;         // where listen() is not given one; 0: any free one
  bool insecure = false;             // nothing is encrypted; and without identities in `access`
                                     // whoever reaches the address may read and publish
  access_options access = {};        // who may do what; see access.hpp
  bool page = true;                  // serve the page at /
  std::string web = {}; // serve the files of this folder, in place of the page's where names are the same.
                        // Whoever reaches the address may read them. listen() reads them into memory: 4096
                        // files and 64 MiB at most, which limits::footprint_bytes() does not know
  std::vector<std::string> allow_origins = {}; // pages of these origins may connect, besides our own
  std::vector<std::string> allow_hosts = {};   // names this endpoint may be called by, besides localhost

  // endpoint::connect only. A failed attempt is repeated until the endpoint is closed: first after
  // `retry_min`, then after twice that time, and so on up to `retry_max`. Each time is shortened at random,
  // by up to a quarter.
  std::string token = {}; // proves to the other side who we are. Over `ws` everyone on the way can read it
  std::string token_file = {}; // or a file whose first line is the token, and that only its owner can read
                               // (below $CREDENTIALS_DIRECTORY others may, too); connect() reads it
  duration retry_min = std::chrono::milliseconds{250};
  duration retry_max = std::chrono::seconds{5};

  // The options that a file of TOML says (docs/config.md); what it does not say has its default. settings.hpp
  // reads the environment and a command line, too. Errors: bad_config, where `why` says what is wrong and
  // where, also of what listen() would refuse. Set-up.
  static result<endpoint_options> from_file(const std::string& path, std::string* why = nullptr);
};

// What is wrong with the folder that the option `web` names, in words that name the file; empty: nothing.
// Reads all of it. Set-up; waits for the disk; allocates.
std::string check_web(const std::string& folder);

// Which of the values that were published and not yet taken are retained.
enum class keep : std::uint8_t {
  all,    // every one, up to `depth`; one more is refused with errc::full
  newest, // only the newest; publishing never fails for want of room
};

enum class priority : std::uint8_t { urgent, normal, bulk };

// Whether a type's name is of one of ROS's own packages: std_msgs, geometry_msgs, nav_msgs, sensor_msgs,
// actionlib_msgs, builtin_interfaces, diagnostic_msgs, rosgraph_msgs, shape_msgs, stereo_msgs, tf2_msgs,
// trajectory_msgs, visualization_msgs. In the spelling of ROS 1 or 2, "std_msgs/String" or
// "std_msgs/msg/String".
constexpr bool is_ros_type(std::string_view type) noexcept {
  constexpr std::string_view packages[] = {
      "std_msgs",           "geometry_msgs",   "nav_msgs",          "sensor_msgs", "actionlib_msgs",
      "builtin_interfaces", "diagnostic_msgs", "rosgraph_msgs",     "shape_msgs",  "stereo_msgs",
      "tf2_msgs",           "trajectory_msgs", "visualization_msgs"};
  const std::size_t end = type.find('/');
  if (end == type.npos) return false;
  for (const std::string_view package : packages)
    if (type.substr(0, end) == package) return true;
  return false;
}

// endpoint::advertise and endpoint::subscribe.
struct topic_options {
  // advertise: a value older than this is neither sent nor taken, here and further on (docs/wire.md);
  // more than `poll_period`; 0: it is sent now or never.
  duration ttl = rt::for_ever;
  rowe::keep keep = rowe::keep::all;
  std::uint32_t depth = 0; // values (keep::all) between this thread and the service thread; 1 to 4096; 0: as
                           // many as 64 KiB hold, but 4 to 64
  rowe::priority priority = rowe::priority::normal;
  bool latched = false; // a late subscriber gets the last value
  bool shared = false;  // advertise: peers may publish on the topic, too. False: only those whose role
                        // spells its name (docs/network.md)
  // A topic whose ttl is shorter than its period and than 10 ms is not predicted, but polled.
  duration period = {}; // advertise: how often it is published, for idle::phase; 100 us to 1 h; 0: not known
  std::string_view type = {}; // the type's name on the wire; empty: the schema's, or none
  // subscribe, of a struct. True: members that a message leaves out are as in T{}, as with ROS's own bridge.
  // False: such a message is refused, unless the schema marks the members or_default(). Nothing: true if the
  // topic's type is one of ROS's own, such as geometry_msgs/Twist (is_ros_type()), else false.
  std::optional<bool> fill_missing = {};
  std::uint32_t text_bytes_max = 4096; // publisher<json_text>, subscriber<json_text>: the longest text
  // subscribe, of a struct: how long a command is in force from when it was sent, for latest_within()
  // (docs/drive.md); 20 ms to 10 s. 0: the messages are no commands. Implies keep::newest. If several handles
  // of a topic have one, the shortest holds for all.
  duration lease = {};
  // subscribe, in an endpoint that connects: the server is asked for at most one message in so much time, and
  // discards the others; 1 ms to 1 h, rounded down to milliseconds. 0: for all. If several handles of a topic
  // ask, the shortest holds for all. A server that is none of ours may send more.
  duration throttle = {};
};

// How a recording is compressed (rowe/recording.hpp).
enum class compression : std::uint8_t { none, lz4, zstd };

// endpoint::serve and endpoint::client.
struct service_options {
  std::uint32_t depth = 0;    // serve: calls that wait to be taken; client: calls in flight; 1 to 4096; 0: as
                              // many as 32 KiB hold, but 8 to 16
  std::string_view type = {}; // the service's type on the wire; empty: none
  std::uint32_t text_bytes_max = 4096; // of json_text: the longest request or reply
  // serve: answer in place of the endpoint, which has a service of this name below /rosapi/ (docs/wire.md).
  // False: such a name is refused (reserved_topic). No peer may provide one.
  bool replaces_own = false;
};

// endpoint::open_lane. With the defaults a lane takes 170 KiB of `handle_bytes`.
struct lane_options {
  std::uint32_t depth = 16;            // messages towards the service thread; 1 to 4096
  std::uint32_t inbox_depth = 16;      // messages that wait to be taken; 1 to 4096
  std::uint32_t calls = 8;             // calls in flight and sends that wait; 1 to 4096
  std::uint32_t text_bytes_max = 4096; // the longest message, either way
  rowe::priority priority = rowe::priority::normal;
  bool receive = true; // take part in receiving: the oldest lane that does gets what no other handle takes
};

// endpoint::stop_latch.
struct latch_options {
  std::string_view name = "loop"; // reported; 1 to 31 bytes: letters, digits and . _ : / -
  // A loop that does not look for this long stops all loops; 1 ms to 10 s. 0: 100 ms if the thread that opens
  // the latch has a real-time priority, else 500 ms. So open it on the loop's thread, when that has its
  // priority: an rt::periodic gives it. Elsewhere say the time.
  duration loop_timeout = {};
};

} // namespace rowe
