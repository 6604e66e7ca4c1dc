# One set of compiler settings for every Fortran target: target_link_libraries(... PRIVATE nocdyn_settings).
add_library(nocdyn_settings INTERFACE)

if(CMAKE_Fortran_COMPILER_ID STREQUAL GNU)
  target_compile_options(nocdyn_settings INTERFACE
    # gfortran 12 takes the descriptor of an allocatable that an assignment allocates for uninitialised
    $<$<COMPILE_LANGUAGE:Fortran>:-std=f2018 -Wall -Wextra -pedantic -Wno-maybe-uninitialized>
    $<$<AND:$<COMPILE_LANGUAGE:Fortran>,$<BOOL:${NOCDYN_WARNINGS_AS_ERRORS}>>:-Werror>)
  set(CMAKE_Fortran_FLAGS_RELEASE "-O3")
  set(CMAKE_Fortran_FLAGS_DEBUG "-O0 -g -fcheck=all -ffpe-trap=invalid,zero,overflow -finit-real=snan")
endif()
