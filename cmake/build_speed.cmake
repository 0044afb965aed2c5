# SPDX-License-Identifier: Apache-2.0
# What makes rowe quick to compile where it is the project itself.

# rowe_precompile(NAME HEADERS header... [OPTIONS option...] [LIBS library...] [PROGRAM]): a target whose
# precompiled headers others can use, by rowe_use_precompiled(). Only headers of other makers: they do not
# change while rowe is worked on. What uses them is compiled with the same options (gcc 12 crashes when -O
# differs), and as the same sort of target: position-independent for a library, or for a program (PROGRAM).
function(rowe_precompile name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "PROGRAM" "" "HEADERS;OPTIONS;LIBS")
  file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp CONTENT "int main() {}\n")
  if(arg_PROGRAM)
    add_executable(${name} ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  else()
    add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  endif()
  target_compile_options(${name} PRIVATE ${arg_OPTIONS})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} rowe_warnings)  # macros depend on them
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
endfunction()

# rowe_use_precompiled(TARGET NAME)
function(rowe_use_precompiled target name)
  if(CMAKE_DISABLE_PRECOMPILE_HEADERS)
    return()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${name})
  # gcc 12 finds overlaps and overruns in std::string that are none (its bugs 105329 and 105651), and does not
  # hold its tongue about system headers that were precompiled.
  target_compile_options(${target} PRIVATE
    $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-Wno-array-bounds;-Wno-stringop-overread>)
endfunction()

# rowe_compile_together(TARGET [AT_MOST n]): the sources of a folder become one unit, or units of at most n
# files, because they include the same headers and instantiate the same templates. The files of a unit share
# one anonymous namespace, so their private names differ. With ROWE_ONE_UNIT_A_FOLDER=OFF each file is a unit.
function(rowe_compile_together target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "AT_MOST" "")
  if(NOT ROWE_ONE_UNIT_A_FOLDER)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  foreach(source ${sources})
    if(NOT source MATCHES "\\.cpp$" OR source MATCHES "^\\$<")
      continue()
    endif()
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} OUTPUT_VARIABLE path)
    cmake_path(RELATIVE_PATH path BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
    cmake_path(GET path PARENT_PATH folder)
    string(MAKE_C_IDENTIFIER ${folder} folder)
    math(EXPR count_${folder} "0${count_${folder}} + 1")
    set(unit ${folder})
    if(arg_AT_MOST)
      math(EXPR number "(${count_${folder}} - 1) / ${arg_AT_MOST}")
      set(unit ${folder}_${number})
    endif()
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${unit})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

if(NOT PROJECT_IS_TOP_LEVEL)
  return()
endif()

# gcc collects garbage for the first time when it has taken 128 MB, which a precompiled header alone nearly
# takes. Where there is memory for it, it may take 512 MB first.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  cmake_host_system_information(RESULT memory QUERY TOTAL_PHYSICAL_MEMORY)  # MiB
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  math(EXPR heap "512 * ${memory} / ${cores}")  # KiB: half of it, for as many compilations as there are cores
  if(heap GREATER 524288)
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-heapsize=524288>)
  endif()
endif()

find_program(ROWE_CCACHE ccache)
if(ROWE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  message(STATUS "rowe: compiles through ${ROWE_CCACHE}")
  # What ccache asks for where headers are precompiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
                                  ${ROWE_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${ROWE_CCACHE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)
  endif()
endif()
