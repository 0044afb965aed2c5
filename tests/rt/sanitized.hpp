// SPDX-License-Identifier: Apache-2.0
// ROWE_TEST_SANITIZED is defined in a build with a sanitizer that has the heap and mlock() to itself.
#pragma once

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define ROWE_TEST_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer) || __has_feature(address_sanitizer)
#define ROWE_TEST_SANITIZED 1
#endif
#endif
