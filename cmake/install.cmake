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

# The commands in Python, and what they read: as seen from bin, share/nocdyn/python (src/app/commands/python_command.f90).
set(data_dir ${CMAKE_INSTALL_DATADIR}/nocdyn)
install(DIRECTORY scripts/nocdyn_report scripts/nocdyn_verify scripts/nocdyn_import python/nocdyn DESTINATION ${data_dir}/python
  PATTERN __pycache__ EXCLUDE)
install(DIRECTORY verification DESTINATION ${data_dir})
install(DIRECTORY input/paper DESTINATION ${data_dir}/input)
find_file(NOCDYN_D3 d3.min.js PATHS /usr/share/nodejs/d3/dist NO_DEFAULT_PATH DOC "D3, for the figures of reports")
if(NOCDYN_D3)
  install(FILES ${NOCDYN_D3} DESTINATION ${data_dir})
else()
  message(STATUS "No D3 (Debian: node-d3) to install: nocdyn report will look for that of the system")
endif()
install(FILES LICENSE LICENSE-sobol-points DESTINATION ${CMAKE_INSTALL_DOCDIR})
foreach(page IN ITEMS nocdyn.1 nocdyn-input.5)
  string(REGEX MATCH ".$" section ${page})
  install(FILES ${PROJECT_BINARY_DIR}/docs/${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section})
endforeach()

# to read, and to begin rules of one's own with: the program has their texts
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/analyse/rules/ DESTINATION ${data_dir}/rules FILES_MATCHING PATTERN "*.rule")
install(TARGETS nocdyn EXPORT nocdyn_targets ARCHIVE COMPONENT library)
install(DIRECTORY ${PROJECT_BINARY_DIR}/modules/ DESTINATION ${CMAKE_INSTALL_LIBDIR}/nocdyn/modules
  COMPONENT library FILES_MATCHING PATTERN *.mod)
install(EXPORT nocdyn_targets NAMESPACE nocdyn:: DESTINATION ${package_dir} COMPONENT library)

# With NOCDYN_BUNDLED: the libraries of NetCDF and of the compilers, and what they need but glibc, for nocdyn-sweep and libnocdyn_c, which
# find them by their RPATH. A component of its own: a package of a system with NetCDF leaves it out.
if(NOCDYN_BUNDLED)
  install(CODE "
    set(programs \"$<$<TARGET_EXISTS:nocdyn_sweep_program>:$<TARGET_FILE:nocdyn_sweep_program>>\")
    set(library \"$<$<TARGET_EXISTS:nocdyn_c>:$<TARGET_FILE:nocdyn_c>>\")
    set(folder \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/lib/nocdyn\")
    include(\"${PROJECT_SOURCE_DIR}/cmake/bundle.cmake\")" COMPONENT bundled_libraries)
endif()

configure_package_config_file(cmake/nocdyn-config.cmake.in nocdyn-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(nocdyn-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nocdyn-config.cmake ${PROJECT_BINARY_DIR}/nocdyn-config-version.cmake
  DESTINATION ${package_dir} COMPONENT library)
