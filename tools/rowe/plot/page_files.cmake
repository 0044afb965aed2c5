# SPDX-License-Identifier: Apache-2.0
# What HTML files of `rowe plot` consist of becomes a part of the program, as the page's files do
# (src/page/CMakeLists.txt, which has found esbuild and dygraphs): plot_page_files are the assembler files.
# dygraphs is in them once more: the tools see of the library no more than its interface.
set(page ${PROJECT_SOURCE_DIR}/src/page)
set(plot_page ${CMAKE_CURRENT_LIST_DIR}/page)
set(plot_bundled ${CMAKE_CURRENT_BINARY_DIR}/plot_page)
foreach(entry plot.js plot.css)
  add_custom_command(
    OUTPUT ${plot_bundled}/${entry}
    COMMAND ${ROWE_ESBUILD} ${plot_page}/${entry} --outfile=${plot_bundled}/${entry} --bundle --minify
            --format=iife --target=es2022 --charset=utf8 --log-level=warning
    DEPENDS ${plot_page}/${entry} ${page}/plot_look.js ${page}/plot_look.css ${page}/colours.css
    COMMENT "Bundling ${entry}"
    VERBATIM)
endforeach()

cmake_path(GET ROWE_DYGRAPHS PARENT_PATH dygraphs)
set(plot_page_files)
foreach(file ${plot_bundled}/plot.js ${plot_bundled}/plot.css ${page}/colours.css ${ROWE_DYGRAPHS}
             ${dygraphs}/dygraph.min.css /usr/share/doc/libjs-dygraphs/copyright)
  cmake_path(GET file FILENAME asset)
  string(REPLACE "." "_" id plot_${asset})
  set(assembler ${plot_bundled}/${id}.S)
  add_custom_command(
    OUTPUT ${assembler}
    COMMAND ${CMAKE_COMMAND} -DID=${id} -DFILE=${file} -DASSEMBLER=${assembler} -P ${page}/embed.cmake
    DEPENDS ${file} ${page}/embed.cmake
    COMMENT "Embedding ${asset}"
    VERBATIM)
  # .incbin is invisible to the compiler's list of dependencies.
  set_source_files_properties(${assembler} PROPERTIES OBJECT_DEPENDS ${file})
  list(APPEND plot_page_files ${assembler})
endforeach()
