# Programs for other machines than this one: wheels and Debian packages.
set(NOCDYN_LEVELS "" CACHE STRING
  "Levels of x86-64, x86-64-v2;x86-64-v3: programs for the first one, and for each other one beside them (with NOCDYN_NATIVE=OFF)")
option(NOCDYN_BUNDLED "Programs that need glibc only: compiler libraries static, those of NetCDF to be installed beside nocdyn-sweep" OFF)

set(faster_levels "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$" AND NOT NOCDYN_NATIVE)
  set(faster_levels ${NOCDYN_LEVELS})
endif()
list(POP_FRONT faster_levels base_level)   # both are empty on other processors

set(nocdyn_runtime stdc++)
add_library(nocdyn_bundled INTERFACE)   # for the programs
if(NOCDYN_BUNDLED)
  function(find_static out name)
    execute_process(COMMAND ${CMAKE_Fortran_COMPILER} -print-file-name=${name} OUTPUT_VARIABLE file OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(NOT IS_ABSOLUTE "${file}")
      message(FATAL_ERROR "NOCDYN_BUNDLED needs ${name}, which ${CMAKE_Fortran_COMPILER} does not find")
    endif()
    set(${out} ${file} PARENT_SCOPE)
  endfunction()
  find_static(fortran libgfortran.a)
  find_static(stdcxx libstdc++.a)
  set(nocdyn_runtime ${fortran} ${stdcxx})
  find_static(gomp libgomp.a)
  set(OpenMP_gomp_LIBRARY ${gomp})   # what find_package(OpenMP) would look for
  target_link_options(nocdyn_bundled INTERFACE -static-libgcc -s LINKER:--as-needed)
  execute_process(COMMAND ${CMAKE_Fortran_COMPILER} -print-file-name=libquadmath.a OUTPUT_VARIABLE quadmath OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(IS_ABSOLUTE "${quadmath}")   # libgfortran, which comes later, needs it; not on processors whose long numbers are quadruple
    target_link_options(nocdyn_bundled INTERFACE LINKER:--whole-archive,${quadmath},--no-whole-archive)
  endif()
  # DT_RPATH: the libraries of NetCDF find each other there too
  set(CMAKE_INSTALL_RPATH "$ORIGIN/../lib/nocdyn")
  set(CMAKE_BUILD_WITH_INSTALL_RPATH ON)
  add_link_options(LINKER:--disable-new-dtags)
endif()
