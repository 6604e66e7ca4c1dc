!> Programs in C that nocdyn writes: what they begin with, compiled by the compiler of the system and loaded.
module nocdyn_compiled_code
  use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_null_char, c_null_funptr, c_ptr, c_size_t
  use nocdyn_c_texts, only: copy_text
  implicit none (type, external)
  private

  public :: code_part, load_code

  !> When a program is compiled: if it pays, always if it can, never.
  character(len=6), parameter, public :: compile_choices(3) = ['auto  ', 'always', 'never ']
  integer, parameter, public :: compile_auto = 1, compile_always = 2, compile_never = 3

  integer, parameter, public :: series_part = 1    !! Taylor arithmetic
  integer, parameter, public :: steps_part = 2     !! plain steps of a block of lanes
  integer, parameter, public :: crossings_part = 3 !! changes of branches in these steps
  integer, parameter, public :: turns_part = 4     !! the steps that are taken at once
  integer, parameter, public :: machine_part = 5   !! derivative and steps of one machine

  !> Procedures of a loaded program; it stays loaded.
  type, public :: loaded_code_t
    type(c_funptr) :: series = c_null_funptr   !! `nocdyn_series`
    type(c_funptr) :: steps = c_null_funptr    !! `nocdyn_steps`
    type(c_funptr) :: work = c_null_funptr     !! `nocdyn_work`
    type(c_funptr) :: branches = c_null_funptr !! `nocdyn_branches`
  end type loaded_code_t

  integer, parameter :: longest_message = 400

  interface
    type(c_ptr) function c_code_part(part, length) bind(c, name='nocdyn_code_part')
      import :: c_int, c_ptr, c_size_t
      integer(c_int), value, intent(in) :: part
      integer(c_size_t), intent(out) :: length
    end function c_code_part

    integer(c_int) function c_load_code(text, length, names, count, procedures, message, capacity) &
      bind(c, name='nocdyn_load_code')
      import :: c_char, c_funptr, c_int, c_size_t
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value, intent(in) :: length
      character(kind=c_char), intent(in) :: names(*)   !! each followed by a null character
      integer(c_int), value, intent(in) :: count
      type(c_funptr), intent(out) :: procedures(*)     !! [count]
      character(kind=c_char), intent(out) :: message(*)
      integer(c_size_t), value, intent(in) :: capacity
    end function c_load_code
  end interface

contains

  !> A part of programs that is the same for all machines.
  function code_part(part) result(text)
    integer, intent(in) :: part   !! series_part and so on
    character(len=:), allocatable :: text
    integer(c_size_t) :: length
    type(c_ptr) :: address

    address = c_code_part(int(part, c_int), length)
    call copy_text(address, length, text)
  end function code_part

  !> Compiles and loads a program, or loads it from the user's cache folder. Threads may call it.
  subroutine load_code(text, loaded, failure)
    character(len=*), intent(in) :: text
    type(loaded_code_t), intent(out) :: loaded
    character(len=:), allocatable, intent(out) :: failure   !! why it is not loaded, ''
    character(len=longest_message, kind=c_char) :: message
    type(c_funptr) :: procedures(4)
    integer(c_int) :: status

    status = c_load_code(text, len(text, c_size_t), 'nocdyn_series' // c_null_char // 'nocdyn_steps' // c_null_char // &
                         'nocdyn_work' // c_null_char // 'nocdyn_branches' // c_null_char, size(procedures, kind=c_int), &
                         procedures, message, int(longest_message, c_size_t))
    loaded = loaded_code_t(procedures(1), procedures(2), procedures(3), procedures(4))
    failure = ''
    if (status /= 0) failure = message(:index(message, c_null_char) - 1)
  end subroutine load_code

end module nocdyn_compiled_code
