# SPDX-License-Identifier: Apache-2.0
# cmake -D valgrind=PROGRAM -D program=expiry_steps -P expiry_instructions.cmake
# Fails when a message that waits for a peer and expires takes 5 % more instructions with 100 000 others
# waiting than with ten. Instructions, not time: they are the same on a busy machine.
set(steps 20000)
if(NOT valgrind)
  message("skipped: valgrind is not installed")
  return()
endif()

function(count_instructions pending result)
  execute_process(COMMAND ${valgrind} --tool=callgrind --callgrind-out-file=/dev/null
                          --toggle-collect=expiry_steps ${program} ${pending}
                  ERROR_VARIABLE said RESULT_VARIABLE status)
  if(NOT status EQUAL 0 OR NOT said MATCHES "Collected *: *([0-9]+)")
    message(FATAL_ERROR "callgrind failed:\n${said}")
  endif()
  set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

count_instructions(10 few)
count_instructions(100000 many)
math(EXPR each_few "${few} / ${steps}")
math(EXPR each_many "${many} / ${steps}")
message("instructions for a message that waits and expires: ${each_few} with 10 others, "
        "${each_many} with 100000")
math(EXPR high "105 * ${few} / 100")
if(few EQUAL 0 OR many GREATER high)
  message(FATAL_ERROR "it costs more among many")
endif()
