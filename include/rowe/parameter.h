/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// Parameters in C: values that a loop reads in each cycle, and that its program and its peers can change
// while it runs. Peers read and write them by the services of ROS (`/rosapi/get_param`, `/rosapi/set_param`);
// to write one takes the right `set` of a role. Each change is published on the topic `/rowe/parameters`.
//
// A parameter is for one thread at a time. It outlives its endpoint safely.
#pragma once
#include <rowe/loop.h>

#ifdef __cplusplus
extern "C" {
#endif

struct rowe_parameter;

// A parameter that begins as `first`, and is from `least` to `most`. A text has at most 124 bytes. Errors:
// bad_argument (a name that is empty or too long), reserved_topic (a name below /rowe/), out_of_range
// (`first` is not allowed), too_long (a text), parameter_taken, too_many_parameters, closed. Free with
// rowe_parameter_free().
struct rowe_parameter* rowe_parameter_bool(const struct rowe_endpoint* endpoint, const char* name,
                                           bool first);
struct rowe_parameter* rowe_parameter_integer(const struct rowe_endpoint* endpoint, const char* name,
                                              int64_t first, int64_t least, int64_t most);
struct rowe_parameter* rowe_parameter_double(const struct rowe_endpoint* endpoint, const char* name,
                                             double first, double least, double most);
struct rowe_parameter* rowe_parameter_text(const struct rowe_endpoint* endpoint, const char* name,
                                           const char* first);
// Peers do not see it any more. NULL is fine.
void rowe_parameter_free(struct rowe_parameter* parameter);

// The newest value. False, 0, or an empty text, if the parameter is of another type or NULL. The text ends in
// '\0', and is valid until the next call.
ROWE_RT bool rowe_parameter_get_bool(struct rowe_parameter* parameter);
ROWE_RT int64_t rowe_parameter_get_integer(struct rowe_parameter* parameter);
ROWE_RT double rowe_parameter_get_double(struct rowe_parameter* parameter);
ROWE_RT const char* rowe_parameter_get_text(struct rowe_parameter* parameter);

// Sets it, for peers too. Under rowe_idle_wake one call of the kernel. Errors: out_of_range, too_long (a
// text), closed, misuse (it is of another type).
ROWE_RT int rowe_parameter_set_bool(struct rowe_parameter* parameter, bool value);
ROWE_RT int rowe_parameter_set_integer(struct rowe_parameter* parameter, int64_t value);
ROWE_RT int rowe_parameter_set_double(struct rowe_parameter* parameter, double value);
ROWE_RT int rowe_parameter_set_text(struct rowe_parameter* parameter, const char* value);

#ifdef __cplusplus
}
#endif
