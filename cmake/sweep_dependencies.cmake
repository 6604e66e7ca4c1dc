# What the programs nocdyn-sweep and nocdyn-mpi need; nocdyn and its library link none of it.
if(NOCDYN_MPI AND NOT NOCDYN_SWEEP)
  message(FATAL_ERROR "NOCDYN_MPI needs NOCDYN_SWEEP: nocdyn-mpi writes the same files as nocdyn-sweep")
endif()

list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})
if(NOCDYN_SWEEP)
  find_package(NetCDF_Fortran)
  if(NOT NetCDF_Fortran_FOUND)
    message(FATAL_ERROR "NetCDF-Fortran is missing: install it (Debian: libnetcdff-dev), "
      "or build without the sweeps by -DNOCDYN_SWEEP=OFF")
  endif()
  find_package(NLopt CONFIG)
  if(NOT NLopt_FOUND)
    message(FATAL_ERROR "NLopt is missing: install it (Debian: libnlopt-dev), or build without the sweeps by -DNOCDYN_SWEEP=OFF")
  endif()
endif()

if(NOCDYN_MPI)
  find_package(MPI COMPONENTS Fortran)
  if(NOT MPI_Fortran_FOUND OR NOT MPI_Fortran_HAVE_F08_MODULE)
    message(FATAL_ERROR "MPI with the Fortran module mpi_f08 is missing: install it (Debian: libopenmpi-dev openmpi-bin), "
      "or build without nocdyn-mpi by -DNOCDYN_MPI=OFF")
  endif()
endif()
