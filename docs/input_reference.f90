!> Prints the reference of groups and keys, in Markdown, for the documentation.
program nocdyn_input_reference
  use, intrinsic :: iso_fortran_env, only: output_unit
  use nocdyn_schema_reference, only: input_reference
  implicit none (type, external)

  write (output_unit, '(a)') input_reference()
end program nocdyn_input_reference
