!> What every program of the benchmark does around its integration: arguments, time measurement, report.
!>
!> A program prints one line, a JSON object with the seconds of every repetition and its counts, and leaves the states
!> at the output times in a file of native doubles, one output after the other.
module contest
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: text_argument, number_argument, whole_argument, seconds_now, numbers_of_file, write_states, print_report

contains

  function text_argument(position) result(text)
    integer, intent(in) :: position
    character(len=:), allocatable :: text
    integer :: length

    if (position > command_argument_count()) error stop 'contest: too few arguments'
    call get_command_argument(position, length=length)
    allocate (character(len=length) :: text)
    call get_command_argument(position, text)
  end function text_argument

  function number_argument(position) result(number)
    integer, intent(in) :: position
    real(wp) :: number
    character(len=:), allocatable :: text

    text = text_argument(position)
    read (text, *) number
  end function number_argument

  function whole_argument(position) result(number)
    integer, intent(in) :: position
    integer :: number
    character(len=:), allocatable :: text

    text = text_argument(position)
    read (text, *) number
  end function whole_argument

  !> Monotonic time [s].
  function seconds_now() result(seconds)
    real(wp) :: seconds
    integer(int64) :: ticks, rate

    call system_clock(ticks, rate)
    seconds = real(ticks, wp) / real(rate, wp)
  end function seconds_now

  !> All of a file of native doubles, `rows` to a column.
  function numbers_of_file(file, rows) result(numbers)
    character(len=*), intent(in) :: file
    integer, intent(in) :: rows
    real(wp), allocatable :: numbers(:, :)
    integer :: unit, bytes

    open (newunit=unit, file=file, access='stream', form='unformatted', status='old', action='read')
    inquire (unit=unit, size=bytes)
    allocate (numbers(rows, bytes / (rows * storage_size(1.0_wp) / 8)))
    read (unit) numbers
    close (unit)
  end function numbers_of_file

  subroutine write_states(file, states)
    character(len=*), intent(in) :: file
    real(wp), intent(in) :: states(:, :)   !! [states, outputs]
    integer :: unit

    open (newunit=unit, file=file, access='stream', form='unformatted', status='replace', action='write')
    write (unit) states
    close (unit)
  end subroutine write_states

  subroutine print_report(seconds, steps, evaluations)
    real(wp), intent(in) :: seconds(:)    !! of each repetition
    integer, intent(in) :: steps          !! attempts, accepted or rejected
    integer, intent(in) :: evaluations    !! of the right-hand side
    integer :: i

    write (output_unit, '(a)', advance='no') '{"steps": ' // to_text(steps) // ', "evaluations": ' // to_text(evaluations) // &
      ', "seconds": ['
    do i = 1, size(seconds)
      if (i > 1) write (output_unit, '(a)', advance='no') ', '
      write (output_unit, '(es13.6)', advance='no') seconds(i)
    end do
    write (output_unit, '(a)') ']}'
  end subroutine print_report

end module contest
