!> The running program, its environment, execution of another program, and procedures of loaded shared libraries.
module nocdyn_posix_programs
  use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_intptr_t, c_loc, c_null_char, c_null_ptr, c_ptr, c_size_t
  use nocdyn_posix, only: last_failure
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: program_file, program_folder, program_in_path, environment, set_environment, exec_program, find_library_procedure

  integer, parameter :: longest_path = 4096   ! PATH_MAX

  interface
    integer(c_intptr_t) function c_readlink(path, target, capacity) bind(c, name='readlink')
      import :: c_char, c_intptr_t, c_size_t
      character(kind=c_char), intent(in) :: path(*)
      character(kind=c_char), intent(out) :: target(*)
      integer(c_size_t), value, intent(in) :: capacity
    end function c_readlink

    integer(c_int) function c_execv(path, arguments) bind(c, name='execv')
      import :: c_char, c_int, c_ptr
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr), intent(in) :: arguments(*)
    end function c_execv

    integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: name(*), value(*)
      integer(c_int), value, intent(in) :: overwrite
    end function c_setenv

    integer(c_int) function c_access(path, mode) bind(c, name='access')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value, intent(in) :: mode
    end function c_access

    type(c_funptr) function c_dlsym(library, name) bind(c, name='dlsym')
      import :: c_char, c_funptr, c_ptr
      type(c_ptr), value, intent(in) :: library
      character(kind=c_char), intent(in) :: name(*)
    end function c_dlsym
  end interface

contains

  !> The path of the running program's file; empty if it cannot be found.
  function program_file() result(file)
    character(len=:), allocatable :: file
    character(len=longest_path) :: path
    integer :: length

    path = ''
    length = int(c_readlink('/proc/self/exe' // c_null_char, path, int(longest_path, c_size_t)))
    file = path(:max(length, 0))
  end function program_file

  !> The folder of the running program's file, with a final slash; empty if it cannot be found.
  function program_folder() result(folder)
    character(len=:), allocatable :: folder

    folder = program_file()
    folder = folder(:index(folder, '/', back=.true.))
  end function program_folder

  !> Whether a path is that of a program that may be started.
  logical function is_program(path)
    character(len=*), intent(in) :: path
    integer(c_int), parameter :: may_execute = 1   ! X_OK

    is_program = c_access(path // c_null_char, may_execute) == 0
  end function is_program

  !> The path of a program in the folders of the environment variable PATH; empty if none has it.
  function program_in_path(name) result(path)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: folders, path
    integer :: colon

    folders = environment('PATH')
    do while (folders /= '')
      colon = index(folders // ':', ':')
      path = folders(:colon - 1) // '/' // name
      if (colon > 1) then
        if (is_program(path)) return
      end if
      folders = folders(min(colon, len(folders)) + 1:)
    end do
    path = ''
  end function program_in_path

  !> The value of an environment variable; empty if it is not set.
  function environment(name) result(value)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: value
    integer :: length

    call get_environment_variable(name, length=length)
    allocate (character(len=length) :: value)
    if (length > 0) call get_environment_variable(name, value)
  end function environment

  !> Sets an environment variable of this process and of the programs that it starts.
  subroutine set_environment(name, value)
    character(len=*), intent(in) :: name, value
    integer(c_int) :: status

    status = c_setenv(name // c_null_char, value // c_null_char, 1_c_int)
    if (status /= 0) error stop 'nocdyn_posix_programs: there is memory for environment variables, and they have names'
  end subroutine set_environment

  !> Replaces this process by another program; returns only if that failed.
  subroutine exec_program(program, words, failure)
    character(len=*), intent(in) :: program                  !! path of its file
    type(string_t), intent(in) :: words(:)                   !! its arguments
    character(len=:), allocatable, intent(out) :: failure    !! reason
    type(c_ptr), allocatable :: addresses(:)
    character(len=:), allocatable, target :: texts
    integer(c_int) :: status
    integer :: begins(size(words) + 1), i

    texts = program // c_null_char
    begins(1) = 1
    do i = 1, size(words)
      begins(i + 1) = len(texts) + 1
      texts = texts // words(i)%text // c_null_char
    end do
    allocate (addresses(size(words) + 2))
    do i = 1, size(begins)
      addresses(i) = c_loc(texts(begins(i):begins(i)))
    end do
    addresses(size(addresses)) = c_null_ptr
    status = c_execv(program // c_null_char, addresses)
    failure = last_failure()
  end subroutine exec_program

  !> The address of a procedure of the shared libraries that this program has loaded, null if none has it.
  type(c_funptr) function find_library_procedure(name)
    character(len=*), intent(in) :: name

    find_library_procedure = c_dlsym(c_null_ptr, name // c_null_char)
  end function find_library_procedure

end module nocdyn_posix_programs
