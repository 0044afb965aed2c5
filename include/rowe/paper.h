/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// The names that the paper of 2015 prints ("Design and Implementation of rowe, a Web-Friendly Communication
// Library", Inria technical report 452). So its listings compile as they are. A program that uses JSON-C as
// well cannot include this, because the names are JSON-C's. Differences: docs/c-api.md.
#pragma once
#include <rowe/rowe.h>

#define json_object rowe_object
#define rowe_enpoint rowe_endpoint // as it stands there

#define json_type_null rowe_type_null
#define json_type_boolean rowe_type_boolean
#define json_type_double rowe_type_double
#define json_type_int rowe_type_int
#define json_type_object rowe_type_object
#define json_type_array rowe_type_array
#define json_type_string rowe_type_string

#define json_object_put rowe_object_free
