# SPDX-License-Identifier: Apache-2.0
# cmake -D valgrind=PROGRAM -D program=FILE -D counted=wheel_steps -D steps=100000 -D few=1000 -D many=1000000
#       [-D of=KIND] [-D percent_max=N] -P instructions.cmake
# Fails when a step of the function `counted` takes 5 % more instructions with many things there than with
# few, or 5 % fewer; with percent_max, when it takes more than so many percent of those with few. The program
# is told of what kind they are, if it has several, and how many; and does so many steps. Instructions, not
# time: they are the same on a busy machine.
if(NOT valgrind)
  message("skipped: valgrind is not installed")
  return()
endif()

function(count_instructions pending result)
  execute_process(COMMAND ${valgrind} --tool=callgrind --callgrind-out-file=/dev/null
                          --toggle-collect=${counted} ${program} ${of} ${pending}
                  ERROR_VARIABLE said RESULT_VARIABLE status)
  if(NOT status EQUAL 0 OR NOT said MATCHES "Collected *: *([0-9]+)")
    message(FATAL_ERROR "callgrind failed:\n${said}")
  endif()
  set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

count_instructions(${few} instructions_few)
count_instructions(${many} instructions_many)
math(EXPR tenths_few "10 * ${instructions_few} / ${steps}")
math(EXPR tenths_many "10 * ${instructions_many} / ${steps}")
message("tenths of instructions for one step of ${counted} ${of}: ${tenths_few} with ${few}, "
        "${tenths_many} with ${many}")
set(percent_min 95)
if(percent_max)
  set(percent_min 0)
else()
  set(percent_max 105)
endif()
math(EXPR low "${percent_min} * ${instructions_few} / 100")
math(EXPR high "${percent_max} * ${instructions_few} / 100")
if(instructions_few EQUAL 0 OR instructions_many LESS low OR instructions_many GREATER high)
  message(FATAL_ERROR "with ${many} it takes less than ${percent_min} % or more than ${percent_max} %")
endif()
