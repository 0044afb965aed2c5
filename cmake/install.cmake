# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where: headers, an archive for each target, what find_package and pkg-config
# read, the program rowe. Nothing of it names a folder outside the prefix, so that the prefix can be moved;
# only systemd's unit has the program's path.
#
# Component rowe_rt is rowe::rt, usable alone; rowe_library, with it, is rowe::rowe and rowe::c; rowe_programs
# needs neither, nor does rowe_ros1.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(rowe_package ${CMAKE_INSTALL_LIBDIR}/cmake/rowe)
set(rowe_made ${CMAKE_CURRENT_BINARY_DIR}/installed)

set_target_properties(rowe_rt PROPERTIES EXPORT_NAME rt)
set_target_properties(rowe_tripwire PROPERTIES EXPORT_NAME tripwire)
set_target_properties(rowe_c PROPERTIES EXPORT_NAME c)

install(TARGETS rowe_rt rowe_tripwire EXPORT rowe_rt
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT rowe_rt
        OBJECTS DESTINATION ${CMAKE_INSTALL_LIBDIR}/rowe COMPONENT rowe_rt
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS rowe rowe_c EXPORT rowe_library
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT rowe_library
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/rt/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT rowe_rt
        FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        COMPONENT rowe_library FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT rowe_rt)
if(TARGET rowe_cli)
  install(TARGETS rowe_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT rowe_programs)
  # systemd looks there below /usr and /usr/local, whatever the folder of libraries is called. Only when it is
  # installed is the prefix known; systemd's own path need not have it.
  install(CODE "
    get_filename_component(prefix \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
    get_filename_component(program \"${CMAKE_INSTALL_BINDIR}/rowe\" ABSOLUTE BASE_DIR \"\${prefix}\")
    file(READ \"${PROJECT_SOURCE_DIR}/contrib/systemd/rowe@.service\" unit)
    string(REPLACE \"ExecStart=rowe \" \"ExecStart=\${program} \" unit \"\${unit}\")
    file(WRITE \"${rowe_made}/rowe@.service\" \"\${unit}\")" COMPONENT rowe_programs)
  install(FILES ${rowe_made}/rowe@.service DESTINATION lib/systemd/system COMPONENT rowe_programs)
  # Manual pages and completion come out of the program itself.
  if(NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR)
    set(manual ${rowe_made}/manual)
    add_custom_command(OUTPUT ${manual}/written ${manual}/rowe.bash ${manual}/_rowe ${manual}/rowe.fish
      COMMAND ${CMAKE_COMMAND} -E make_directory ${manual}/man1
      COMMAND rowe_cli man --output ${manual}/man1
      COMMAND ${CMAKE_COMMAND} -E touch ${manual}/written
      COMMAND rowe_cli completion bash > ${manual}/rowe.bash
      COMMAND rowe_cli completion zsh > ${manual}/_rowe
      COMMAND rowe_cli completion fish > ${manual}/rowe.fish
      DEPENDS rowe_cli VERBATIM)
    add_custom_target(rowe_manual ALL DEPENDS ${manual}/written)
    install(DIRECTORY ${manual}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT rowe_programs)
    install(FILES ${manual}/rowe.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
            RENAME rowe COMPONENT rowe_programs)
    install(FILES ${manual}/_rowe DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions
            COMPONENT rowe_programs)
    install(FILES ${manual}/rowe.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d
            COMPONENT rowe_programs)
  endif()
endif()

if(TARGET rowe_ros1) # what else is installed needs no ROS, so this is asked for by its name
  install(TARGETS rowe_ros1 RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT rowe_ros1)
endif()

# find_package(rowe CONFIG)
foreach(part rt library)
  install(EXPORT rowe_${part} FILE rowe-${part}-targets.cmake NAMESPACE rowe:: DESTINATION ${rowe_package}
          COMPONENT rowe_${part})
endforeach()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/rowe-config.cmake.in ${rowe_made}/rowe-config.cmake
                              INSTALL_DESTINATION ${rowe_package} NO_SET_AND_CHECK_MACRO)
# 0.x may break what 0.y had.
write_basic_package_version_file(${rowe_made}/rowe-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${rowe_made}/rowe-config.cmake ${rowe_made}/rowe-config-version.cmake
        DESTINATION ${rowe_package} COMPONENT rowe_rt)

# pkg-config rowe, rowe-c, rowe-rt. Folders are given from where the file is.
file(RELATIVE_PATH rowe_prefix ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" rowe_prefix "\${pcfiledir}/${rowe_prefix}")
set(rowe_libdir "\${prefix}")
cmake_path(APPEND rowe_libdir ${CMAKE_INSTALL_LIBDIR})
set(rowe_includedir "\${prefix}")
cmake_path(APPEND rowe_includedir ${CMAKE_INSTALL_INCLUDEDIR})
list(JOIN rowe_packing_wanted ", " rowe_packing_listed)
string(REPLACE ">=" " >= " rowe_pc_requires
               "${rowe_lws_wanted}, ${rowe_simdjson_wanted}, ${rowe_crypto_wanted}, ${rowe_tls_wanted}, "
               ${rowe_packing_listed})
get_target_property(rowe_cxx_libraries rowe_c INTERFACE_LINK_LIBRARIES)
list(FILTER rowe_cxx_libraries EXCLUDE REGEX "[<:]")
list(TRANSFORM rowe_cxx_libraries PREPEND "-l")
list(JOIN rowe_cxx_libraries " " rowe_cxx_libraries)
foreach(name rowe rowe-c rowe-rt)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/${name}.pc.in ${rowe_made}/${name}.pc @ONLY)
endforeach()
install(FILES ${rowe_made}/rowe-rt.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT rowe_rt)
install(FILES ${rowe_made}/rowe.pc ${rowe_made}/rowe-c.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
        COMPONENT rowe_library)
