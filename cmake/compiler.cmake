# One set of compiler settings for every Fortran target: target_link_libraries(... PRIVATE nocdyn_settings).
add_library(nocdyn_settings INTERFACE)
# OpenMP everywhere: it also keeps local variables off static memory, so that every procedure may run in a thread.
target_link_libraries(nocdyn_settings INTERFACE OpenMP::OpenMP_Fortran)

set(CMAKE_Fortran_PREPROCESS OFF)   # no source has directives; a pass less for each of them

if(CMAKE_Fortran_COMPILER_ID STREQUAL GNU)
  target_compile_options(nocdyn_settings INTERFACE
    # Procedures that override others have the arguments of these, wanted or not.
    # gfortran 12 takes the descriptor of an allocatable that an assignment allocates for uninitialised
    $<$<COMPILE_LANGUAGE:Fortran>:-std=f2018 -Wall -Wextra -pedantic -Wno-maybe-uninitialized
      -Wno-unused-dummy-argument>
    $<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<BOOL:${NOCDYN_WARNINGS_AS_ERRORS}>>:-Werror>)
  # No contraction to fused multiply-adds: vector loops and their remainders then round alike, and a lane's result does
  # not depend on its place in a block.
  # No vector forms of sines and powers, which glibc has and declares to gfortran in a file that it reads first: they have other
  # bits than the scalar ones, and other bits for each length of vectors. The option that hides the file hides the intrinsic modules too.
  execute_process(COMMAND ${CMAKE_Fortran_COMPILER} -print-file-name=finclude
    OUTPUT_VARIABLE intrinsic_modules OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  set(CMAKE_Fortran_FLAGS_RELEASE "-O3 -ffp-contract=off -nostdinc -fintrinsic-modules-path ${intrinsic_modules}")
  if(NOCDYN_NATIVE)
    string(APPEND CMAKE_Fortran_FLAGS_RELEASE " -march=native")
  elseif(base_level)
    string(APPEND CMAKE_Fortran_FLAGS_RELEASE " -march=${base_level}")
    if(base_level MATCHES "v[34]$")
      # gfortran 12 fuses the products of complex numbers into vfmaddsub whatever -ffp-contract says, where it may use the instruction
      string(APPEND CMAKE_Fortran_FLAGS_RELEASE " -mno-fma")
    endif()
  endif()
  set(CMAKE_Fortran_FLAGS_DEBUG "-O0 -g -fcheck=all -ffpe-trap=invalid,zero,overflow -finit-real=snan")
elseif(CMAKE_Fortran_COMPILER_ID STREQUAL LLVMFlang)
  set(CMAKE_Fortran_FLAGS_RELEASE "-O1 -ffp-contract=off")   # a check, not a program to be used: quick to compile
  set(CMAKE_Fortran_LINKER_WRAPPER_FLAG "-Wl,")   # CMake 3.25 does not know how Flang hands options to the linker
  set(CMAKE_Fortran_LINKER_WRAPPER_FLAG_SEP ",")
endif()
