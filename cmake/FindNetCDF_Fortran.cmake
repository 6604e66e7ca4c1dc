# NetCDF-Fortran, which Debian 12 ships without a CMake package: imported target NetCDF::NetCDF_Fortran.
# Asked in this order: pkg-config, nf-config, the folders that CMake searches (CMAKE_PREFIX_PATH).
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(PC_NetCDF_Fortran QUIET netcdf-fortran)
  if(PC_NetCDF_Fortran_FOUND)
    pkg_get_variable(PC_NetCDF_Fortran_FMODDIR netcdf-fortran fmoddir)
  endif()
endif()
find_program(NetCDF_Fortran_CONFIG nf-config)
mark_as_advanced(NetCDF_Fortran_CONFIG)
if(NetCDF_Fortran_CONFIG)
  execute_process(COMMAND ${NetCDF_Fortran_CONFIG} --includedir
    OUTPUT_VARIABLE config_include_dir OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  execute_process(COMMAND ${NetCDF_Fortran_CONFIG} --prefix
    OUTPUT_VARIABLE config_prefix OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()

find_path(NetCDF_Fortran_MODULE_DIR netcdf.mod
  HINTS ${PC_NetCDF_Fortran_FMODDIR} ${PC_NetCDF_Fortran_INCLUDEDIR} ${PC_NetCDF_Fortran_INCLUDE_DIRS} ${config_include_dir})
find_library(NetCDF_Fortran_LIBRARY netcdff
  HINTS ${PC_NetCDF_Fortran_LIBDIR} ${PC_NetCDF_Fortran_LIBRARY_DIRS} ${config_prefix}/lib)
mark_as_advanced(NetCDF_Fortran_MODULE_DIR NetCDF_Fortran_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(NetCDF_Fortran
  REQUIRED_VARS NetCDF_Fortran_LIBRARY NetCDF_Fortran_MODULE_DIR
  VERSION_VAR PC_NetCDF_Fortran_VERSION)

if(NetCDF_Fortran_FOUND AND NOT TARGET NetCDF::NetCDF_Fortran)
  add_library(NetCDF::NetCDF_Fortran UNKNOWN IMPORTED)
  # An option instead of an include directory: CMake leaves out /usr/include, where gfortran does not look for modules.
  set_target_properties(NetCDF::NetCDF_Fortran PROPERTIES
    IMPORTED_LOCATION ${NetCDF_Fortran_LIBRARY}
    INTERFACE_COMPILE_OPTIONS $<$<COMPILE_LANGUAGE:Fortran>:-I${NetCDF_Fortran_MODULE_DIR}>)
endif()
