# Copies the shared libraries of the executables `programs` and the library `library` to `folder`, but those of glibc, which every
# Linux has in its own version.
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${programs} LIBRARIES ${library}
  RESOLVED_DEPENDENCIES_VAR libraries UNRESOLVED_DEPENDENCIES_VAR missing
  PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|mvec|dl|rt|pthread|resolv|util|anl)\\.so")
if(missing)
  message(FATAL_ERROR "${programs} ${library}: libraries that are not there: ${missing}")
endif()
file(MAKE_DIRECTORY ${folder})
foreach(file IN LISTS libraries)   # by the names that programs ask for; a wheel has no links
  cmake_path(GET file FILENAME name)
  file(REAL_PATH ${file} file)
  file(COPY_FILE ${file} ${folder}/${name})
endforeach()
