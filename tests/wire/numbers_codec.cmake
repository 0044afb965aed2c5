# SPDX-License-Identifier: Apache-2.0
# A third codec, for tests of what knows none of them, and for fuzzers.
add_library(rowe_numbers_codec STATIC ${CMAKE_CURRENT_LIST_DIR}/numbers_codec.cpp)
target_include_directories(rowe_numbers_codec PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
target_link_libraries(rowe_numbers_codec PUBLIC rowe_wire PRIVATE rowe_warnings)
