# SPDX-License-Identifier: Apache-2.0
# cmake -D valgrind=PROGRAM -D program=wheel_steps -P wheel_instructions.cmake
# Fails when cancelling and inserting an entry takes 5 % more instructions with a million entries pending than
# with a thousand, or 5 % fewer. Instructions, not time: they are the same on a busy machine.
set(steps 100000)
if(NOT valgrind)
  message("skipped: valgrind is not installed")
  return()
endif()

function(count_instructions pending result)
  execute_process(COMMAND ${valgrind} --tool=callgrind --callgrind-out-file=/dev/null
                          --toggle-collect=wheel_steps ${program} ${pending}
                  ERROR_VARIABLE said RESULT_VARIABLE status)
  if(NOT status EQUAL 0 OR NOT said MATCHES "Collected *: *([0-9]+)")
    message(FATAL_ERROR "callgrind failed:\n${said}")
  endif()
  set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

count_instructions(1000 few)
count_instructions(1000000 many)
math(EXPR tenths_few "10 * ${few} / ${steps}")
math(EXPR tenths_many "10 * ${many} / ${steps}")
message("tenths of instructions for a cancel and an insert: ${tenths_few} with 1000 pending, "
        "${tenths_many} with 1000000")
math(EXPR low "95 * ${few} / 100")
math(EXPR high "105 * ${few} / 100")
if(few EQUAL 0 OR many LESS low OR many GREATER high)
  message(FATAL_ERROR "the two differ by more than 5 %")
endif()
