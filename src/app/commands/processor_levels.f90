!> Programs that are built for several levels of x86-64: the one for all processors starts the one that fits this processor.
module nocdyn_processor_levels
  use, intrinsic :: iso_c_binding, only: c_int
  use nocdyn_command_line, only: command_line
  use nocdyn_posix_programs, only: exec_program, program_file
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: become_faster, level_of

  character(len=*), parameter :: infix = '-x86-64-v'   ! of the names of programs: nocdyn-x86-64-v3
  integer, parameter :: lowest_level = 3               ! that may have a program of its own

  interface
    integer(c_int) function c_processor_level() bind(c, name='nocdyn_processor_level')
      import :: c_int
    end function c_processor_level
  end interface

contains

  !> Replaces this program by the one beside it for the highest level that the processor has. Returns if there is none, and if it
  !> cannot be started: this program computes the same.
  subroutine become_faster()
    character(len=:), allocatable :: failure, file, path
    integer :: level
    logical :: exists

    file = program_file()
    if (level_of(file) /= '') return
    do level = int(c_processor_level()), lowest_level, -1
      path = file // infix // to_text(level)
      inquire (file=path, exist=exists)
      if (exists) call exec_program(path, command_line(), failure)
    end do
  end subroutine become_faster

  !> '-x86-64-v3', what the name of a program for this level ends with; '' of a program for all processors.
  pure function level_of(file) result(ending)
    character(len=*), intent(in) :: file   !! path of the program
    character(len=:), allocatable :: ending

    ending = file(max(1, len(file) - len(infix)):)
    if (index(ending, infix) /= 1) ending = ''
  end function level_of

end module nocdyn_processor_levels
