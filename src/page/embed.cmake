# SPDX-License-Identifier: Apache-2.0
# cmake -DID= -DFILE= [-DGZIP= -DCOMPRESSED=] -DASSEMBLER= -P embed.cmake
#
# Compresses FILE to COMPRESSED, if that is given, and writes ASSEMBLER. On x86-64 and on arm64 this defines
#
#   rowe_asset_ID       … rowe_asset_ID_end         the bytes of FILE
#   rowe_asset_ID_etag                              its ETag, quoted, `etag_chars` long
#   rowe_asset_ID_gzip  … and so on                 the same of COMPRESSED
#
# A strong ETag names bytes, so each form has its own: the first half of its SHA-256.
set(text "        .section .rodata.rowe_page,\"a\",%progbits\n")
function(embed symbol file)
  file(SHA256 ${file} hash)
  string(SUBSTRING ${hash} 0 32 tag)
  foreach(name ${symbol} ${symbol}_end ${symbol}_etag)
    string(APPEND text "        .global ${name}\n        .hidden ${name}\n")
  endforeach()
  string(APPEND text "        .balign 16\n${symbol}:\n        .incbin \"${file}\"\n${symbol}_end:\n"
                     "${symbol}_etag:\n        .ascii \"\\\"${tag}\\\"\"\n")
  set(text "${text}" PARENT_SCOPE)
endfunction()
embed(rowe_asset_${ID} ${FILE})
if(COMPRESSED)
  execute_process(COMMAND ${GZIP} -9nc ${FILE} OUTPUT_FILE ${COMPRESSED} COMMAND_ERROR_IS_FATAL ANY)
  embed(rowe_asset_${ID}_gzip ${COMPRESSED})
endif()
string(APPEND text "        .section .note.GNU-stack,\"\",%progbits\n")
file(WRITE ${ASSEMBLER} "${text}")
