# Copies the shared libraries of `program` to `folder`, but those of glibc, which every Linux has in its own version.
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${program}
  RESOLVED_DEPENDENCIES_VAR libraries UNRESOLVED_DEPENDENCIES_VAR missing
  PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|mvec|dl|rt|pthread|resolv|util|anl)\\.so")
if(missing)
  message(FATAL_ERROR "${program} needs libraries that are not there: ${missing}")
endif()
file(MAKE_DIRECTORY ${folder})
foreach(library IN LISTS libraries)   # by the names that programs ask for; a wheel has no links
  cmake_path(GET library FILENAME name)
  file(REAL_PATH ${library} file)
  file(COPY_FILE ${file} ${folder}/${name})
endforeach()
