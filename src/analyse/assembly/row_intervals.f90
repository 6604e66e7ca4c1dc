!> How dense the rows of a run must be to show the vibration that its excitations and motors cause.
module nocdyn_row_intervals
  use nocdyn_bank, only: harmonic_t, role_load
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_output_times, only: row_count
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: choose_row_count, fastest_rate, note_sparse_rows

  real(wp), parameter :: sparse = 0.25_wp        ! of an oscillation between two rows: what they show is not its size
  real(wp), parameter :: dense = 0.1_wp          ! what is recommended
  integer, parameter :: most_rows = 100001       ! that a run writes without having been asked
  real(wp), parameter :: small = 0.05_wp         ! of the largest amplitude of an excitation: smaller harmonics do not count
  real(wp), parameter :: pi = acos(-1.0_wp)

  !> The fastest oscillation that counts.
  type :: oscillation_t
    real(wp) :: rate = 0.0_wp      ! [rad/s]
    integer :: bank = 0, element = 0
  end type oscillation_t

contains

  !> Adds a note if the rows are too far apart for the fastest excitation at the speeds of the run.
  subroutine note_sparse_rows(machine, lowest, highest, interval, notes)
    type(machine_t), intent(in) :: machine                 !! one lane
    real(wp), intent(in) :: lowest(:), highest(:)          !! speeds of the bodies in the run [rad/s], [bodies]
    real(wp), intent(in) :: interval                       !! between two rows [s]
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(oscillation_t) :: fastest
    real(wp) :: frequency   ! [Hz]

    fastest = fastest_oscillation(machine, lowest, highest)
    frequency = fastest%rate / (2 * pi)
    if (.not. frequency * interval > sparse) return
    associate (bank => machine%banks(fastest%bank)%bank)
      call append(notes, 'the rows are ' // rounded_text(interval, 3) // ' s apart and do not show the vibration by ' // &
                  trim(bank%kind_name()) // ' ' // quoted(bank%names(fastest%element)%text) // ', up to ' // &
                  rounded_text(frequency, 3) // ' Hz; it would take &output interval = ' // &
                  rounded_text(dense / frequency, 2) // '. Smallest and largest values are those of the motion between rows')
    end associate
  end subroutine note_sparse_rows

  !> The number of rows of a run. Where the input gives none they show the fastest excitation at the speeds of the start, and a
  !> note says so if the usual ones do not.
  subroutine choose_row_count(input, machine, rows, notes)
    type(input_t), intent(in) :: input       !! that `check_output_times` accepts
    type(machine_t), intent(in) :: machine   !! one lane
    integer, intent(out) :: rows
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(oscillation_t) :: fastest
    real(wp) :: oscillations, span

    rows = row_count(input)
    associate (output => input%groups(input%position('output')), run => input%groups(input%position('run')))
      if (output%has_value('interval') .or. output%is_given('points')) return
      span = run%number('t_end') - run%number('t_start')
    end associate
    fastest = fastest_oscillation(machine, machine%start_speed(1, :), machine%start_speed(1, :))
    oscillations = fastest%rate / (2 * pi) * span
    if (.not. oscillations > sparse * (rows - 1)) return
    rows = max(rows, 1 + ceiling(min(oscillations / dense, real(most_rows - 1, wp))))
    associate (bank => machine%banks(fastest%bank)%bank)
      call append(notes, to_text(rows) // ' rows for ' // trim(bank%kind_name()) // ' ' // &
                  quoted(bank%names(fastest%element)%text) // ' with ' // rounded_text(fastest%rate / (2 * pi), 3) // &
                  ' Hz, as &output gives no interval')
    end associate
  end subroutine choose_row_count

  !> The fastest oscillation that counts at any of the speeds [rad/s].
  real(wp) function fastest_rate(machine, lowest, highest) result(rate)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: lowest(:), highest(:)   !! of the bodies [rad/s], [bodies]
    type(oscillation_t) :: fastest

    fastest = fastest_oscillation(machine, lowest, highest)
    rate = fastest%rate
  end function fastest_rate

  !> The fastest oscillation of an excitation at any of the speeds, with an amplitude that counts among the ones of its element,
  !> or of the transients of a motor.
  type(oscillation_t) function fastest_oscillation(machine, lowest, highest) result(fastest)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: lowest(:), highest(:)   !! [rad/s], [bodies]
    type(harmonic_t), allocatable :: list(:)
    real(wp) :: rate, speed
    integer :: b, e, i

    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role == role_load) cycle
        do e = 1, bank%count
          if (bank%has_ended(e)) cycle
          rate = bank%transient_frequency(e, allocated(machine%steady_internal))
          if (rate > fastest%rate) fastest = oscillation_t(rate, b, e)
          speed = 0.0_wp
          associate (body => bank%rows%last_body(e))
            if (body > 0) speed = merge(lowest(body), highest(body), abs(lowest(body)) > abs(highest(body)))
          end associate
          call bank%list_harmonics(e, speed, list)
          do i = 1, size(list)
            if (list(i)%is_twist) cycle
            if (abs(list(i)%amplitude) < small * maxval(abs(list%amplitude), mask=.not. list%is_twist)) cycle
            rate = abs(list(i)%frequency)
            if (list(i)%body > 0) then
              rate = max(abs(list(i)%frequency + list(i)%order * lowest(list(i)%body)), &
                         abs(list(i)%frequency + list(i)%order * highest(list(i)%body)))
            end if
            if (rate > fastest%rate .and. abs(list(i)%amplitude) > 0) fastest = oscillation_t(rate, b, e)
          end do
        end do
      end associate
    end do
  end function fastest_oscillation

end module nocdyn_row_intervals
