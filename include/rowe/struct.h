/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// Structs of a C program as messages: a table says once which members a struct has, and loops then publish
// and receive the struct itself. The library's thread writes and reads the JSON.
//
//   struct pose { double x, y; char frame[32]; };
//   static const struct rowe_member pose_members[] = {
//       ROWE_MEMBER(struct pose, x, rowe_member_double),
//       ROWE_MEMBER(struct pose, y, rowe_member_double),
//       ROWE_MEMBER(struct pose, frame, rowe_member_text),
//   };
//   static const struct rowe_struct pose_type = {"my_robot/Pose", sizeof(struct pose), pose_members, 3};
//
// A table is checked where it is used at set-up, and copied: it may then go. What is wrong with it is
// rowe_error_bad_argument, and rowe_last_error_text() names the member and the limit: a name that is missing,
// empty, no UTF-8, too long or there twice; a type that is none; a size that is not the type's; a member that
// is misaligned, lies beyond the struct or on another one; tables that nest too deep, contain themselves, or
// have too many members (enum rowe_struct_limits).
//
// Functions marked ROWE_RT and handles are as in rowe/loop.h.
#pragma once
#include <rowe/loop.h>

#ifdef __cplusplus
extern "C" {
#endif

enum rowe_struct_limits {
  rowe_struct_members_max = 1024,      // of a table; the names of an integer likewise
  rowe_struct_members_all_max = 16384, // with everything inside; the elements of an array count once
  rowe_struct_name_bytes_max = 128,
  rowe_struct_depth_max = 32 // a table in a table is a level, an array of tables two
};

// What a member is, and the form in which it is written: a type, or a type | forms.
enum rowe_member_type {
  rowe_member_bool = 1, // bool
  rowe_member_int8,     // int8_t; and so on
  rowe_member_int16,
  rowe_member_int32,
  rowe_member_int64,
  rowe_member_uint8, // an array of them is bytes: text in base64
  rowe_member_uint16,
  rowe_member_uint32,
  rowe_member_uint64,
  rowe_member_float,
  rowe_member_double,
  rowe_member_text,     // char[N]: UTF-8 of up to N - 1 bytes, which ends in '\0'
  rowe_member_struct,   // a struct with a table of its own
  rowe_member_time,     // int64_t: nanoseconds since 1970
  rowe_member_duration, // int64_t: nanoseconds

  // Forms.
  rowe_member_as_string = 0x100,   // of integers: in quotes, since a browser rounds what is beyond 2^53
  rowe_member_as_seconds = 0x200,  // of times and durations: 1.5 for 1500000000 ns
  rowe_member_as_numbers = 0x400,  // of arrays of uint8_t: [1,255] instead of base64
  rowe_member_or_default = 0x800,  // a message may leave it out; then it is all zeroes
  rowe_member_decimals_0 = 0x1000, // of float and double: rounded to so many digits behind the point
  rowe_member_decimals_1 = 0x2000,
  rowe_member_decimals_2 = 0x3000,
  rowe_member_decimals_3 = 0x4000,
  rowe_member_decimals_4 = 0x5000,
  rowe_member_decimals_5 = 0x6000,
  rowe_member_decimals_6 = 0x7000,
  rowe_member_decimals_7 = 0x8000,
  rowe_member_decimals_8 = 0x9000,
  rowe_member_decimals_9 = 0xa000,
  // Of integers with names: "mapping" instead of 1. Read from a name or the number of one; nothing else gets
  // in. A value without a name is written as its number.
  rowe_member_by_name = 0x10000
};

struct rowe_struct;

// A value of an enum and its name: UTF-8, 1 to 128 bytes.
struct rowe_name {
  const char* name;
  int64_t value; // of a uint64_t beyond INT64_MAX: its bits
};

// A row of a table. The macros below fill it in.
struct rowe_member {
  const char* name;                 // in the text: UTF-8, 1 to 128 bytes
  int type;                         // enum rowe_member_type
  size_t offset;                    // from the struct's first byte
  size_t bytes;                     // its sizeof; of an array, that of an element
  size_t count;                     // 0: no array; else its elements, or the most where they are counted
  int count_type;                   // 0: all elements are in use; else the type of the counting member, an
                                    // integer of the same struct: so many elements are, from the first on.
                                    // A negative count is 0, and one that is too large all
  size_t count_offset;              // of the counting member, which needs no row of its own. Where messages
                                    // arrive it is set to the length of their array
  const struct rowe_struct* inside; // of rowe_member_struct: its table
  const char* other_name;           // by which messages may have it as well; NULL: none
  const struct rowe_name* names;    // of an integer: those of its values; NULL: none. Peers that ask for the
                                    // type get them, whatever the form
  size_t name_count;
};

// The table of a struct: its members, in the order in which they are written.
struct rowe_struct {
  const char* name; // of the type, as peers see it: "nav_msgs/Odometry"; NULL: none
  size_t bytes;     // sizeof the struct
  const struct rowe_member* members;
  size_t count; // of the rows
};

// clang-format off
#ifdef __cplusplus
#define ROWE_NOWHERE(of) static_cast<of*>(NULL)
#else
#define ROWE_NOWHERE(of) ((of*)NULL) /* to ask for sizes */
#endif
#define ROWE_MEMBER(of, member, type)                                                                        \
  { #member, type, offsetof(of, member), sizeof(ROWE_NOWHERE(of)->member), 0, 0, 0, NULL, NULL, NULL, 0 }
// An integer that is written by its names, an array of struct rowe_name.
#define ROWE_NAMED(of, member, type, names)                                                                  \
  { #member, (type) | rowe_member_by_name, offsetof(of, member), sizeof(ROWE_NOWHERE(of)->member), 0, 0, 0,  \
    NULL, NULL, names, sizeof(names) / sizeof((names)[0]) }
// A struct inside, by its table.
#define ROWE_INSIDE(of, member, table)                                                                       \
  { #member, rowe_member_struct, offsetof(of, member), sizeof(ROWE_NOWHERE(of)->member), 0, 0, 0,            \
    table, NULL, NULL, 0 }
// An array of which all elements are in use. `table` is NULL; of structs, rowe_member_struct, it is theirs.
#define ROWE_ARRAY(of, member, type, table)                                                                  \
  { #member, type, offsetof(of, member), sizeof(ROWE_NOWHERE(of)->member[0]),                                \
    sizeof(ROWE_NOWHERE(of)->member) / sizeof(ROWE_NOWHERE(of)->member[0]), 0, 0, table, NULL, NULL, 0 }
// The same; the member `counting`, of the type `counting_type`, says how many elements are in use.
#define ROWE_COUNTED(of, member, type, table, counting, counting_type)                                       \
  { #member, type, offsetof(of, member), sizeof(ROWE_NOWHERE(of)->member[0]),                                \
    sizeof(ROWE_NOWHERE(of)->member) / sizeof(ROWE_NOWHERE(of)->member[0]), counting_type,                   \
    offsetof(of, counting), table, NULL, NULL, 0 }
// clang-format on

// ---- Topics of structs

struct rowe_struct_publisher;
struct rowe_struct_subscriber;

// A publisher of structs of `type`, which peers see as `options->type`, else as its name. `options` may be
// NULL; `text_bytes_max` has no meaning here. The default depth is as many structs as 64 KiB hold, but 4 to
// 64. Errors: as rowe_publisher_open(); bad_argument also of the table.
struct rowe_struct_publisher* rowe_struct_publisher_open(const struct rowe_endpoint* endpoint,
                                                         const char* topic, const struct rowe_struct* type,
                                                         const struct rowe_topic_options* options);
void rowe_struct_publisher_free(struct rowe_struct_publisher* publisher); // NULL is fine

// Hands a copy of the struct at `value` to the service thread, which sends it as JSON to all that listen.
// Errors: no_peer (nobody listens: nothing was queued), full. Both are counted, so a loop may ignore them. A
// float that is not finite is written as null, and counted.
ROWE_RT int rowe_struct_publisher_publish(struct rowe_struct_publisher* publisher, const void* value,
                                          int64_t now_ns);
// Whether somebody listens at the moment.
ROWE_RT bool rowe_struct_publisher_wanted(const struct rowe_struct_publisher* publisher);

// A subscriber to what peers publish, and what this process publishes on the same endpoint. A message that is
// not as the table says is dropped and counted (`undecodable`); members that the table does not name are
// passed over. Errors: as rowe_struct_publisher_open().
struct rowe_struct_subscriber* rowe_struct_subscriber_open(const struct rowe_endpoint* endpoint,
                                                           const char* topic, const struct rowe_struct* type,
                                                           const struct rowe_topic_options* options);
void rowe_struct_subscriber_free(struct rowe_struct_subscriber* subscriber); // NULL is fine

// Where a struct came from.
struct rowe_arrival {
  int64_t arrived_ns;    // when its last byte was read, or when it was published in this process
  struct rowe_peer from; // none: this process
};

// Copies into the struct at `into` the oldest one whose time to live is not over, or the newest one; then
// older ones are dropped. With the option `newest` both take the newest, once. `arrival` may be NULL. Reads
// the clock if a struct has a time to live. Errors: empty; `into` and `arrival` are then left alone.
ROWE_RT int rowe_struct_subscriber_try_take(struct rowe_struct_subscriber* subscriber, void* into,
                                            struct rowe_arrival* arrival);
ROWE_RT int rowe_struct_subscriber_latest(struct rowe_struct_subscriber* subscriber, void* into,
                                          struct rowe_arrival* arrival);

// With the option `lease_ms`: copies the command that is in force at `now_ns`, the loop's clock in this cycle
// (docs/drive.md). Errors: empty (none is in force: stand still; `into` and `arrival` are left alone),
// closed, misuse (NULL, or a subscriber without a lease; with one, the calls above and below say misuse).
ROWE_RT int rowe_struct_subscriber_latest_within(struct rowe_struct_subscriber* subscriber, int64_t now_ns,
                                                 void* into, struct rowe_arrival* arrival);

// Waits for the next one, at most `timeout_ms`. Not for a loop: it enters the kernel. It leaves
// rowe_last_error() alone. Errors: timed_out in place of empty.
int rowe_struct_subscriber_take(struct rowe_struct_subscriber* subscriber, long timeout_ms, void* into,
                                struct rowe_arrival* arrival);

#ifdef __cplusplus
}
#endif
