!> The frequency of which all excitations of a machine are multiples: of those over the time, or of orders, whose frequencies
!> follow the mean speed of their body.
module nocdyn_orbit_period
  use nocdyn_bank, only: harmonic_t, role_load
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: quoted, rounded_text, to_text
  implicit none (type, external)
  private

  public :: find_period, follow_period

  real(wp), parameter :: same = 1.0e-9_wp        ! relative difference of equal frequencies
  integer, parameter :: most_multiples = 400     ! of the common frequency
  integer, parameter :: digits = 9               ! of frequencies in messages

  !> The common frequency is `rate` [rad/s], or `rate` times the mean speed of a rigid motion.
  type, public :: orbit_period_t
    integer :: motion = 0                        !! rigid motion; 0: the frequency is fixed
    real(wp) :: rate = 0.0_wp
    integer, allocatable :: multiples(:)         !! of each harmonic
    integer, allocatable, private :: elements(:) !! of the machine, for messages
    real(wp), allocatable, private :: rates(:)   !! of each harmonic
  end type orbit_period_t

contains

  !> Finds it for a machine; without any excitation there are no multiples, and no frequency.
  subroutine find_period(machine, turning, period, error)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: turning(:, :)     !! speeds of the bodies by rigid motions, [bodies, motions]
    type(orbit_period_t), intent(out) :: period
    type(error_t), allocatable, intent(out) :: error
    integer :: i, largest

    call list_rates(machine, turning, period, error)
    if (allocated(error)) return
    if (size(period%rates) == 0) then
      allocate (period%multiples(0))
      return
    end if
    period%rate = period%rates(1)
    do i = 2, size(period%rates)
      call reduce(period%rates(i), maxval(period%rates), period%rate)
      if (.not. period%rate > 0) then
        call raise(error, exit_failed, 'no period is common to the excitations: ' // shown_rate(machine, period, i) // &
                   ' and ' // shown_rate(machine, period, 1) // ' are not commensurate')
        return
      end if
    end do
    largest = maxloc(period%rates, dim=1)
    period%rate = period%rates(largest) / anint(period%rates(largest) / period%rate)
    allocate (period%multiples, source=nint(period%rates / period%rate))
  end subroutine find_period

  !> Finds the common frequency of the machine with another parameter: the harmonics keep their multiples.
  subroutine follow_period(machine, turning, period, error)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: turning(:, :)     !! as in `find_period`
    type(orbit_period_t), intent(inout) :: period
    type(error_t), allocatable, intent(out) :: error
    type(orbit_period_t) :: present
    integer :: i, largest

    call list_rates(machine, turning, present, error)
    if (allocated(error)) return
    if (size(present%rates) /= size(period%multiples)) then
      call raise(error, exit_failed, 'the machine has other excitations at another value of the parameter')
      return
    end if
    if (size(present%rates) == 0) return
    largest = maxloc(present%rates, dim=1)
    period%rate = present%rates(largest) / period%multiples(largest)
    do i = 1, size(present%rates)
      if (abs(present%rates(i) - period%multiples(i) * period%rate) <= same * present%rates(largest)) cycle
      call raise(error, exit_failed, 'no period is common to the excitations over the range: ' // &
                 shown_rate(machine, present, i) // ' and ' // shown_rate(machine, present, largest) // ' change their ratio')
      return
    end do
  end subroutine follow_period

  !> The frequencies of all harmonics: all of them fixed, or all in proportion to one mean speed.
  subroutine list_rates(machine, turning, period, error)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: turning(:, :)
    type(orbit_period_t), intent(inout) :: period
    type(error_t), allocatable, intent(out) :: error
    type(harmonic_t), allocatable :: list(:)
    real(wp) :: speed
    integer :: b, e, i, k

    allocate (period%rates(0), period%elements(0))
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role == role_load) cycle
        do e = 1, bank%count
          speed = 0.0_wp
          do k = bank%rows%first(e), bank%rows%first(e + 1) - 1
            if (bank%rows%body(k) > 0) speed = speed + bank%rows%coefficient(k) * machine%start_speed(1, bank%rows%body(k))
          end do
          call bank%list_harmonics(e, speed, list)
          do i = 1, size(list)
            call add_rate(machine, turning, list(i), bank%first + e - 1, period, error)
            if (allocated(error)) return
          end do
        end do
      end associate
    end do
  end subroutine list_rates

  !> Adds a harmonic, unless it is constant.
  subroutine add_rate(machine, turning, harmonic, element, period, error)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: turning(:, :)
    type(harmonic_t), intent(in) :: harmonic
    integer, intent(in) :: element
    type(orbit_period_t), intent(inout) :: period
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: rate
    integer :: motion

    motion = 0
    rate = abs(harmonic%frequency)
    if (abs(harmonic%order) > 0 .and. abs(harmonic%frequency) > 0) then
      call raise(error, exit_failed, 'the excitation ' // quoted(machine%element_name(element)) // &
                 ' follows the time and the speed at once, which has no period')
      return
    else if (abs(harmonic%order) > 0) then
      if (size(turning, 2) == 0) return   ! its body does not turn: a torque that follows the angle
      motion = maxloc(abs(turning(harmonic%body, :)), dim=1)
      rate = abs(harmonic%order * turning(harmonic%body, motion))
      if (count(abs(turning(harmonic%body, :)) > same) > 1) rate = -1.0_wp
    end if
    if (.not. abs(rate) > 0) return
    if (rate < 0 .or. size(period%rates) > 0 .and. motion /= period%motion) then
      call raise(error, exit_failed, 'no period is common to the excitations: ' // &
                 quoted(machine%element_name(element)) // ' and ' // &
                 quoted(machine%element_name(period%elements(max(1, size(period%elements))))) // &
                 ' follow speeds, or a speed and the time, that keep no ratio')
      return
    end if
    period%motion = motion
    period%rates = [period%rates, rate]
    period%elements = [period%elements, element]
  end subroutine add_rate

  !> Reduces a common frequency by one more: Euclid's algorithm. It becomes zero if they have none.
  pure subroutine reduce(rate, largest, common)
    real(wp), intent(in) :: rate, largest
    real(wp), intent(inout) :: common
    real(wp) :: divided, rest

    divided = rate
    do
      rest = abs(divided - common * anint(divided / common))
      if (rest <= same * largest) return
      divided = common
      common = rest
      if (common * most_multiples < largest) exit
    end do
    common = 0.0_wp
  end subroutine reduce

  function shown_rate(machine, period, number) result(text)
    type(machine_t), intent(in) :: machine
    type(orbit_period_t), intent(in) :: period
    integer, intent(in) :: number   !! of the harmonic
    character(len=:), allocatable :: text

    text = rounded_text(period%rates(number), digits) // ' rad/s'
    if (period%motion > 0) text = 'order ' // rounded_text(period%rates(number), digits)
    text = quoted(machine%element_name(period%elements(number))) // ' with ' // text
  end function shown_rate

end module nocdyn_orbit_period
