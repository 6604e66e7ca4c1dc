!> A program in C of one machine with its numbers: its equations of motion, and steps by their Taylor series.
module nocdyn_machine_code
  use nocdyn_code_layout, only: find_laws, lay_out, layout_t, number_of
  use nocdyn_code_text, only: code_text_t, filled, list_of
  use nocdyn_compiled_code, only: code_part, machine_part
  use nocdyn_kinds, only: wp
  use nocdyn_law_code, only: law_code_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_reduced_series, only: reduced_series_t
  use nocdyn_series_code, only: write_recurrence
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: write_machine_code

contains

  !> Writes a program of one machine, a block of equal lanes, with its numbers: its derivative, and steps.
  subroutine write_machine_code(series, state, twist_at_origin, t_start, start, names, code)
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    real(wp), intent(in) :: twist_at_origin(:, :)   !! [rad], [lanes, elements]
    real(wp), intent(in) :: t_start, start(:)       !! time [s] and state where it starts, [components]
    type(string_t), intent(in) :: names(:)          !! of the states
    type(code_text_t), intent(inout) :: code
    type(law_code_t), allocatable :: laws(:)
    type(layout_t) :: layout
    integer :: b, i

    call find_laws(series, state, laws)
    call lay_out(series, state, laws, layout)
    call code%line('#include <math.h>')
    call code%line('#include <stdio.h>')
    call code%line('#include <stdlib.h>')
    call write_recurrence(series, state, laws, layout, 1, 1, code)
    call write_numbers('law', [series%law(1, :, :, 1)])
    call write_numbers('ratio', series%twists%coefficient(1, :, 1))
    call write_numbers('response', series%accelerations%coefficient(1, :, 1))
    call write_numbers('origin', twist_at_origin(1, :))
    do b = 1, size(laws)
      associate (law => state%banks(number_of(series, b))%law%law)
        call write_numbers(filled('constant_$', [b - 1]), [law%constant(1::law%w, :)])
        call write_numbers(filled('stacked_$', [b - 1]), law%stacked(1::law%w))
      end associate
    end do
    call write_numbers('start', start)
    call code%line('#define MACHINE_START @', a=to_text(t_start))
    call code%line('static const char *const machine_states[] = {')
    do i = 1, size(names)
      call code%line('  "@",', a=names(i)%text)
    end do
    call code%line('};')
    call code%line('#define MACHINE_NUMBERS {1, 1, 0, machine_law, machine_ratio, machine_response, machine_origin, &t, y, \')
    call code%line('  {@}, {@}, {@}}', a=each('machine_constant_'), b=each('machine_stacked_'), c=slots())
    call code%line(code_part(machine_part))

  contains

    subroutine write_numbers(name, numbers)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: numbers(:)

      call code%line('static const double machine_@[] = {@};', a=name, b=list_of(numbers))
    end subroutine write_numbers

    !> The names of the numbers of all banks.
    function each(stem) result(text)
      character(len=*), intent(in) :: stem
      character(len=:), allocatable :: text
      integer :: k

      text = merge('0', ' ', size(laws) == 0)
      do k = 1, size(laws)
        text = text // stem // to_text(k - 1) // merge(', ', '  ', k < size(laws))
      end do
    end function each

    function slots() result(text)
      character(len=:), allocatable :: text
      integer :: k

      text = list_of([(laws(k)%law%elements, k=1, size(laws))])
      text = text(:max(len(text) - 3, 1))
    end function slots

  end subroutine write_machine_code

end module nocdyn_machine_code
