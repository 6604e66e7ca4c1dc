# Programs, library, module files, and a CMake package: find_package(nocdyn) and the target nocdyn::nocdyn.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/nocdyn)

install(TARGETS nocdyn_program RUNTIME)
if(TARGET nocdyn_sweep_program)
  install(TARGETS nocdyn_sweep_program RUNTIME)
endif()
if(TARGET nocdyn_mpi_program)
  install(TARGETS nocdyn_mpi_program RUNTIME)
endif()
if(TARGET nocdyn_c)   # machines in other programs: nocdyn.h
  install(TARGETS nocdyn_c LIBRARY PUBLIC_HEADER)
endif()
# to read, and to begin rules of one's own with: the program has their texts
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/analyse/rules/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nocdyn/rules FILES_MATCHING PATTERN "*.rule")
install(TARGETS nocdyn EXPORT nocdyn_targets ARCHIVE)
install(DIRECTORY ${PROJECT_BINARY_DIR}/modules/ DESTINATION ${CMAKE_INSTALL_LIBDIR}/nocdyn/modules
  FILES_MATCHING PATTERN *.mod)
install(EXPORT nocdyn_targets NAMESPACE nocdyn:: DESTINATION ${package_dir})

configure_package_config_file(cmake/nocdyn-config.cmake.in nocdyn-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(nocdyn-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nocdyn-config.cmake ${PROJECT_BINARY_DIR}/nocdyn-config-version.cmake
  DESTINATION ${package_dir})
