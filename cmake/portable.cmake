# Programs for other machines than this one: wheels and Debian packages.
set(NOCDYN_LEVELS "" CACHE STRING
  "Levels of x86-64, x86-64-v2;x86-64-v3: programs for the first one, and for each other one beside them (with NOCDYN_NATIVE=OFF)")
option(NOCDYN_BUNDLED "Programs that need glibc only: compiler libraries static, those of NetCDF to be installed beside nocdyn-sweep" OFF)

set(faster_levels "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$" AND NOT NOCDYN_NATIVE)
  set(faster_levels ${NOCDYN_LEVELS})
endif()
list(POP_FRONT faster_levels base_level)   # both are empty on other processors

add_library(nocdyn_bundled INTERFACE)   # for the programs
if(NOCDYN_BUNDLED)
  # A folder with the static libraries of the compilers, which is searched first. quadmath: not on all kinds of processors.
  set(static_folder ${PROJECT_BINARY_DIR}/static)
  file(MAKE_DIRECTORY ${static_folder})
  foreach(name IN ITEMS gfortran quadmath stdc++ gomp)
    execute_process(COMMAND ${CMAKE_Fortran_COMPILER} -print-file-name=lib${name}.a OUTPUT_VARIABLE file OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(IS_ABSOLUTE "${file}")
      file(CREATE_LINK ${file} ${static_folder}/lib${name}.a SYMBOLIC)
    elseif(NOT name STREQUAL quadmath)
      message(FATAL_ERROR "NOCDYN_BUNDLED needs lib${name}.a, which ${CMAKE_Fortran_COMPILER} does not find")
    endif()
  endforeach()
  target_link_options(nocdyn_bundled INTERFACE -L${static_folder} -static-libgcc -s)
  # libgomp by its path: find_package(OpenMP) gives that of the shared one, which libnocdyn_c needs (static ones are for programs only)
  set(is_program "$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>")
  set_property(TARGET OpenMP::OpenMP_Fortran PROPERTY INTERFACE_LINK_LIBRARIES
    "$<IF:${is_program},${static_folder}/libgomp.a,${OpenMP_gomp_LIBRARY}>;${OpenMP_pthread_LIBRARY}")
  # DT_RPATH: the libraries of NetCDF find each other there too
  set(CMAKE_INSTALL_RPATH "$ORIGIN/../lib/nocdyn")
  set(CMAKE_BUILD_WITH_INSTALL_RPATH ON)
  add_link_options(LINKER:--disable-new-dtags)
endif()
