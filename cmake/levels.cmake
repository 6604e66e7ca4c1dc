# The programs for the levels of x86-64 after the first of NOCDYN_LEVELS: builds of their own. A program that is started looks for the
# one of its processor beside it (src/app/commands/processor_levels.f90).
include(ExternalProject)
set(level_programs nocdyn)
set(level_targets nocdyn_program)
if(NOCDYN_SWEEP)
  list(APPEND level_programs nocdyn-sweep)
  list(APPEND level_targets nocdyn_sweep_program)
endif()

add_custom_target(nocdyn_package DEPENDS ${level_targets} nocdyn_manual_pages)   # what a wheel has
if(TARGET nocdyn_c)
  add_dependencies(nocdyn_package nocdyn_c)
endif()
if(NOCDYN_MPI)
  add_dependencies(nocdyn_package nocdyn_mpi_program)
endif()

foreach(level IN LISTS faster_levels)
  set(folder ${PROJECT_BINARY_DIR}/${level})
  ExternalProject_Add(nocdyn_${level}
    SOURCE_DIR ${PROJECT_SOURCE_DIR}
    BINARY_DIR ${folder}
    CMAKE_ARGS -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_Fortran_COMPILER=${CMAKE_Fortran_COMPILER}
      -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} -DNOCDYN_NATIVE=OFF -DNOCDYN_LEVELS=${level} -DNOCDYN_BUNDLED=${NOCDYN_BUNDLED}
      -DNOCDYN_SWEEP=${NOCDYN_SWEEP} -DNOCDYN_MPI=OFF -DNOCDYN_C=OFF -DBUILD_TESTING=OFF
    BUILD_COMMAND ${CMAKE_COMMAND} --build ${folder} --target ${level_targets}
    BUILD_ALWAYS ON
    INSTALL_COMMAND ""
    DEPENDS ${level_targets} ${level_before}   # one after the other: each uses all processors
    USES_TERMINAL_BUILD ON)
  set(level_before nocdyn_${level})
  add_dependencies(nocdyn_package nocdyn_${level})
  foreach(program IN LISTS level_programs)
    install(PROGRAMS ${folder}/bin/${program} DESTINATION ${CMAKE_INSTALL_BINDIR} RENAME ${program}-${level})
  endforeach()
endforeach()
