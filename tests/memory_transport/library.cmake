# SPDX-License-Identifier: Apache-2.0
# A transport without sockets, for what runs the core by itself: tests, the simulation, fuzzers, benchmarks.
add_library(rowe_memory_transport STATIC ${CMAKE_CURRENT_LIST_DIR}/memory_transport.cpp)
target_include_directories(rowe_memory_transport PUBLIC ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
target_link_libraries(rowe_memory_transport PUBLIC rowe::rt rowe_access PRIVATE rowe_warnings)
rowe_compile_product(rowe_memory_transport)
