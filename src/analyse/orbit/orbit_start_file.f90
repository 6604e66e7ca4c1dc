!> A guess of the first motion of a branch from a table of a motion over the time, such as trajectory.csv: its last period.
module nocdyn_orbit_start_file
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_orbit_guess, only: guess_samples
  use nocdyn_orbit_series, only: find_series
  use nocdyn_orbit_settings, only: orbit_settings_t
  use nocdyn_output_units, only: match_signal
  use nocdyn_periodic_machine, only: orbit_t, periodic_machine_t
  use nocdyn_signals, only: list_signals, signal_angle, signal_speed, signal_t, signal_time
  use nocdyn_table_file, only: read_list_text
  use nocdyn_text, only: quoted, rounded_text, string_t, to_text
  use nocdyn_text_file, only: path_in, read_text_file
  use nocdyn_units, only: in_si
  implicit none (type, external)
  private

  public :: find_file_guess

  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)   ! [rad]
  integer, parameter :: fewest_rows = 16                 ! of a period

contains

  !> The last period in a file with the time, the angles and the speeds of all bodies that coordinates belong to. Internal states
  !> stay those of the steady state. The period is the one of the excitations; of orders, at the mean speed in the file.
  subroutine find_file_guess(input, settings, periodic, guess, error)
    type(input_t), intent(in) :: input
    type(orbit_settings_t), intent(in) :: settings     !! with the name of the file
    type(periodic_machine_t), intent(in) :: periodic
    type(orbit_t), intent(inout) :: guess              !! in the steady state, with its rate; then the motion of the file
    type(error_t), allocatable, intent(out) :: error   !! the file cannot be read or does not have the motion
    type(string_t), allocatable :: messages(:), names(:)
    character(len=:), allocatable :: path, text
    real(wp), allocatable :: internal(:), motion(:, :), states(:, :), values(:, :)
    real(wp) :: begin, period
    integer :: i, line

    path = path_in(input%file(:index(input%file, '/', back=.true.)), settings%start_file)
    call read_text_file(path, text, error)
    if (allocated(error)) then
      error%message = place() // error%message // '; allowed: low, high, settled_run or the name of a file'
      return
    end if
    call read_list_text(text, path, names, line, values, messages)
    if (size(messages) > 0) then
      call raise(error, exit_input, place() // messages(1)%text)
      return
    end if
    call take_motion(periodic, names, values, motion, error)
    if (.not. allocated(error)) call find_period_in(periodic, motion, guess%rate, period, error)
    if (allocated(error)) then
      error%message = place() // settings%start_file // ': ' // error%message
      return
    end if
    associate (f => periodic%machine%freedoms)
      allocate (states(periodic%machine%states - f, guess_samples + 1), internal(periodic%machine%states - 2 * f))
      internal = guess%series(1, f + 1:)
      begin = motion(1, size(motion, 2)) - period
      do i = 0, guess_samples
        states(:f, i + 1) = angles_at(motion, begin + period * i / guess_samples)
        states(f + 1:, i + 1) = internal
      end do
      call find_series(periodic, states, begin, period, guess)
    end associate

  contains

    function place() result(where)
      character(len=:), allocatable :: where

      where = input%location(settings%group, 'start') // ': start = ' // quoted(settings%start_file) // ': '
    end function place

  end subroutine find_file_guess

  !> Finds the columns: the time, then the angles and the speeds of the coordinates, [1 + 2 coordinates, rows], in SI units,
  !> angles from those of the samples.
  subroutine take_motion(periodic, names, values, motion, error)
    type(periodic_machine_t), intent(in) :: periodic
    type(string_t), intent(in) :: names(:)
    real(wp), intent(in) :: values(:, :)                    !! [columns, rows]
    real(wp), allocatable, intent(out) :: motion(:, :)
    type(error_t), allocatable, intent(out) :: error
    type(signal_t), allocatable :: signals(:)
    integer :: c

    associate (machine => periodic%machine%formulation%machine, f => periodic%machine%freedoms)
      call list_signals(machine, signals)
      allocate (motion(1 + 2 * f, size(values, 2)))
      call take(signal_time, 0, 1)
      do c = 1, f
        associate (b => machine%coordinates%body(c))
          if (.not. allocated(error)) call take(signal_angle, b, 1 + c)
          if (.not. allocated(error)) call take(signal_speed, b, 1 + f + c)
          if (.not. allocated(error)) motion(1 + c, :) = motion(1 + c, :) - machine%start_angle(1, b)
        end associate
      end do
      if (allocated(error)) return
      do c = 2, size(motion, 2)
        if (motion(1, c) > motion(1, c - 1)) cycle
        call raise(error, exit_input, 'the time does not rise in row ' // to_text(c))
        return
      end do
    end associate

  contains

    subroutine take(kind, body, row)
      integer, intent(in) :: kind, body, row
      integer :: column, i, unit
      logical :: is_former, matches

      do i = 1, size(signals)
        if (signals(i)%source%kind == kind .and. (kind == signal_time .or. signals(i)%source%index == body)) exit
      end do
      do column = 1, size(names)
        call match_signal(signals(i), names(column)%text, [integer ::], matches, unit, is_former)
        if (.not. matches) cycle
        motion(row, :) = in_si(values(column, :), unit)
        return
      end do
      call raise(error, exit_input, 'there is no column ' // quoted(signals(i)%name // ' [' // signals(i)%unit // ']') // &
                 '; needed: t, and the angles and speeds of all bodies, as in trajectory.csv')
    end subroutine take

  end subroutine take_motion

  !> The period of the motion in a file [s], which must be there.
  subroutine find_period_in(periodic, motion, rate, period, error)
    type(periodic_machine_t), intent(in) :: periodic
    real(wp), intent(in) :: motion(:, :)
    real(wp), intent(in) :: rate       !! of the excitation at the first value [rad/s]
    real(wp), intent(out) :: period
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: rounding = 1.0e-6_wp
    real(wp) :: last(periodic%machine%freedoms), speed, whole
    integer :: k

    associate (end => motion(1, size(motion, 2)), m => periodic%period%motion)
      whole = end - motion(1, 1)
      period = turn / rate
      do k = 1, merge(3, 0, m > 0)   ! the speed over the last period, which it gives
        last = angles_at(motion, end) - angles_at(motion, end - min(period, whole))
        speed = abs(last(periodic%free(m))) / min(period, whole)
        if (speed > 0) period = turn * periodic%subharmonic / (periodic%period%rate * speed)
      end do
      if (period > whole .and. period <= (1.0_wp + rounding) * whole) period = whole
      if (period > whole) then
        call raise(error, exit_input, 'its ' // rounded_text(whole, 6) // ' s do not cover a period of the motion, ' // &
                   rounded_text(period, 6) // ' s')
      else if (count(motion(1, :) > end - period) < fewest_rows) then
        call raise(error, exit_input, 'its last period, ' // rounded_text(period, 6) // ' s, has ' // &
                   to_text(count(motion(1, :) > end - period)) // ' rows; needed: ' // to_text(fewest_rows))
      end if
    end associate
  end subroutine find_period_in

  !> Angles of the coordinates at a time: cubic polynomials by the angles and speeds of the rows beside it.
  pure function angles_at(motion, t) result(angles)
    real(wp), intent(in) :: motion(:, :)   !! [1 + 2 coordinates, rows]
    real(wp), intent(in) :: t              !! [s]
    real(wp) :: angles(size(motion, 1) / 2)
    real(wp) :: h, s
    integer :: f, first, last, middle

    f = size(angles)
    first = 1
    last = size(motion, 2)
    do while (last > first + 1)
      middle = (first + last) / 2
      if (motion(1, middle) > t) then
        last = middle
      else
        first = middle
      end if
    end do
    associate (before => motion(:, first), after => motion(:, last))
      h = after(1) - before(1)
      s = (t - before(1)) / h
      angles = (1.0_wp + 2 * s) * (1.0_wp - s)**2 * before(2:f + 1) + s**2 * (3.0_wp - 2 * s) * after(2:f + 1) + &
               h * s * (1.0_wp - s) * ((1.0_wp - s) * before(f + 2:) - s * after(f + 2:))
    end associate
  end function angles_at

end module nocdyn_orbit_start_file
