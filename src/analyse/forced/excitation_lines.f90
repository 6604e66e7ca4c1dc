!> The lines of excitation of a machine: the frequencies at which its excitations act, and their moments.
!>
!> A line is an order, whose frequency grows with the speed, or a fixed frequency. Excitations of the same frequency are one line:
!> their moments have phases to each other, by the angles of the bodies to which their orders refer. The linear machine is solved
!> line by line.
module nocdyn_excitation_lines
  use nocdyn_bank, only: harmonic_t, role_load
  use nocdyn_dynamic_stiffness, only: band_work_t, dynamic_stiffness_t, new_band_work
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: new_lines, line_order, new_line_work, solve_line, find_twist, lost_power

  !> One line.
  type, public :: line_t
    real(wp) :: order = 0.0_wp       !! oscillations per turn of the reference body, at the first speed
    logical :: is_order = .true.     !! whether its frequency is proportional to the speed; else a fixed frequency is in it
    logical :: is_fixed = .false.    !! whether its frequency is the same at all speeds
    logical :: is_slip = .false.     !! whether it is twice the slip frequency of a motor that starts asynchronously
    integer :: family = 0            !! frequencies of one family keep their ratios at all speeds
    integer, allocatable :: source(:)     !! harmonics, numbered over all elements
  contains
    procedure :: word
  end type line_t

  !> A harmonic of an element.
  type, public :: source_t
    integer :: element = 0
    real(wp) :: frequency = 0.0_wp      !! Omega at this speed [rad/s]
    real(wp) :: order = 0.0_wp          !! oscillations per turn of the reference body
    complex(wp) :: moment = 0.0_wp      !! moment exp(i Omega t) on `to` [N m], or a twist in series with the element [rad]
    logical :: is_twist = .false.       !! the latter
    logical :: is_slip = .false.        !! as of a line
  end type source_t

  !> A harmonic as its element lists it.
  type, public :: listed_harmonic_t
    type(harmonic_t) :: harmonic
    integer :: lister = 0               !! the element
  end type listed_harmonic_t

  !> Work space of one thread, and the last solution.
  type, public :: line_work_t
    type(band_work_t) :: band
    complex(wp), allocatable :: stiffness(:)    !! [N m/rad], [elements]
    complex(wp), allocatable :: series(:)       !! twists in series with the elements [rad], [elements]
  end type line_work_t

  real(wp), parameter :: same = 1.0e-9_wp   ! relative difference of equal frequencies

  public :: list_machine_harmonics, list_sources, set_sources

contains

  !> What tables, reports and figures call a line: its order, 'fixed', 'twice-slip', or 'varying' if its frequency follows the
  !> speed of a body that has no constant ratio to the reference body.
  function word(self) result(text)
    class(line_t), intent(in) :: self
    character(len=:), allocatable :: text

    text = 'varying'
    if (self%is_slip) text = 'twice-slip'
    if (self%is_fixed) text = 'fixed'
    if (self%is_order) text = rounded_text(self%order, 6)
  end function word

  !> The harmonics of all elements at a steady state.
  subroutine list_sources(machine, state, sources, shaker)
    type(machine_t), intent(in) :: machine      !! with its periodic torques
    type(held_state_t), intent(in) :: state
    type(source_t), allocatable, intent(out) :: sources(:)
    integer, intent(in), optional :: shaker     !! the only element that counts, whose frequency is `speed` of the state;
                                                !! absent or 0: all count
    type(listed_harmonic_t), allocatable :: list(:)

    call list_machine_harmonics(machine, state, list, shaker)
    call set_sources(list, state, sources)
  end subroutine list_sources

  !> The harmonics at the speeds of a steady state.
  subroutine list_machine_harmonics(machine, state, list, shaker, only)
    type(machine_t), intent(in) :: machine      !! with its periodic torques
    type(held_state_t), intent(in) :: state
    type(listed_harmonic_t), allocatable, intent(out) :: list(:)
    integer, intent(in), optional :: shaker     !! as of `list_sources`
    integer, intent(in), optional :: only       !! the only element that is asked; absent: all are
    type(harmonic_t), allocatable :: of_element(:)
    type(listed_harmonic_t), allocatable :: longer(:)
    integer :: alone, b, e, i, k, n
    real(wp) :: speed
    logical :: is_shaken

    alone = 0
    if (present(shaker)) alone = shaker
    is_shaken = alone > 0
    if (present(only)) alone = only
    n = 0
    allocate (list(64))
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role == role_load) cycle
        if (alone > 0 .and. (alone < bank%first .or. alone > bank%last())) cycle
        do e = 1, bank%count
          if (.not. is_shaken .and. bank%has_ended(e) .or. alone > 0 .and. bank%first + e - 1 /= alone) cycle
          speed = 0.0_wp
          do k = bank%rows%first(e), bank%rows%first(e + 1) - 1
            if (bank%rows%body(k) > 0) speed = speed + bank%rows%coefficient(k) * state%omega(bank%rows%body(k))
          end do
          call bank%list_harmonics(e, speed, of_element)
          if (n + size(of_element) > size(list)) then
            allocate (longer(2 * (n + size(of_element))))
            longer(:n) = list(:n)
            call move_alloc(longer, list)
          end if
          do i = 1, size(of_element)
            if (is_shaken) of_element(i)%frequency = state%speed
            list(n + i) = listed_harmonic_t(of_element(i), bank%first + e - 1)
          end do
          n = n + size(of_element)
        end do
      end associate
    end do
    list = list(:n)
  end subroutine list_machine_harmonics

  !> Harmonics as sources in a steady state.
  subroutine set_sources(list, state, sources)
    type(listed_harmonic_t), intent(in) :: list(:)
    type(held_state_t), intent(in) :: state
    type(source_t), allocatable, intent(out) :: sources(:)
    integer :: i

    allocate (sources(size(list)))
    do i = 1, size(list)
      associate (harmonic => list(i)%harmonic)
        call set_source(harmonic, state, sources(i))
        if (harmonic%by_element > 0) sources(i)%moment = state%mean(harmonic%by_element) * sources(i)%moment
      end associate
    end do
  end subroutine set_sources

  !> A harmonic with phi = phi_0 + omega t, as the real part of moment exp(i Omega t), Omega > 0.
  pure subroutine set_source(harmonic, state, source)
    type(harmonic_t), intent(in) :: harmonic
    type(held_state_t), intent(in) :: state
    type(source_t), intent(inout) :: source
    real(wp) :: angle

    source%element = harmonic%element
    source%is_twist = harmonic%is_twist
    source%is_slip = abs(harmonic%frequency) > 0 .and. abs(harmonic%order) > 0   ! of motors that start asynchronously
    source%frequency = harmonic%frequency + harmonic%order * state%omega(harmonic%body)
    source%order = abs(source%frequency / state%speed)
    if (.not. abs(harmonic%frequency) > 0) source%order = abs(harmonic%order * (state%omega(harmonic%body) / state%speed))
    angle = harmonic%order * state%phi(harmonic%body)
    source%moment = harmonic%amplitude * cmplx(cos(angle), sin(angle), wp)
    if (source%frequency >= 0) return
    source%frequency = -source%frequency
    source%moment = conjg(source%moment)
  end subroutine set_source

  !> The lines of sources at the lowest and the highest speed, ascending by frequency. Harmonics of frequency zero are left out.
  subroutine new_lines(low, high, lines)
    type(source_t), intent(in) :: low(:), high(:)       !! the same harmonics at both speeds
    type(line_t), allocatable, intent(out) :: lines(:)
    integer :: first, k, line_of(size(low)), least, n
    logical :: is_left(size(low))

    n = 0
    line_of = 0
    is_left = low%frequency > 0
    do while (any(is_left))
      n = n + 1
      first = findloc(is_left, .true., dim=1)
      where (is_left .and. is_same(low%frequency, low(first)%frequency) .and. is_same(high%frequency, high(first)%frequency))
        line_of = n
        is_left = .false.
      end where
    end do
    allocate (lines(n))
    is_left = line_of > 0
    do k = 1, n
      least = minloc(low%frequency, dim=1, mask=is_left)
      first = line_of(least)
      lines(k)%source = pack([(least, least=1, size(low))], line_of == first)
      is_left = is_left .and. line_of /= first
      associate (source => lines(k)%source(1))
        lines(k)%order = low(source)%order
        lines(k)%is_order = is_same(low(source)%order, high(source)%order)
        lines(k)%family = k
        if (lines(k)%is_order) lines(k)%family = -1
        lines(k)%is_fixed = is_same(low(source)%frequency, high(source)%frequency)
        if (lines(k)%is_fixed) lines(k)%family = -2
        lines(k)%is_slip = low(source)%is_slip
      end associate
    end do
  end subroutine new_lines

  elemental logical function is_same(a, b)
    real(wp), intent(in) :: a, b

    is_same = abs(a - b) <= same * max(abs(a), abs(b))
  end function is_same

  !> The line of an order of the reference body, 0 if there is none.
  pure integer function line_order(lines, order) result(line)
    type(line_t), intent(in) :: lines(:)
    real(wp), intent(in) :: order
    real(wp), parameter :: typed = 1.0e-5_wp   ! ratios of gears have more digits than one types

    do line = size(lines), 1, -1
      if (lines(line)%is_order .and. abs(lines(line)%order - order) <= typed * order) return
    end do
  end function line_order

  !> Work space for a machine.
  type(line_work_t) function new_line_work(machine, matrix) result(work)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix   !! of it

    work%band = new_band_work(matrix)
    allocate (work%stiffness(machine%elements%count), work%series(machine%elements%count), source=(0.0_wp, 0.0_wp))
  end function new_line_work

  !> Solves for the coordinates at one frequency.
  pure subroutine solve_line(machine, matrix, slopes, frequency, sources, work)
    type(machine_t), intent(in) :: machine
    type(dynamic_stiffness_t), intent(in) :: matrix   !! of it
    type(slopes_t), intent(in) :: slopes
    real(wp), intent(in) :: frequency                 !! Omega [rad/s]
    type(source_t), intent(in) :: sources(:)          !! all with this frequency
    type(line_work_t), intent(inout) :: work
    real(wp), parameter :: beside = 1.0e-9_wp   ! an undamped resonance, where there is no response
    logical :: singular

    call slopes%find_stiffness(machine%elements%internal, cmplx(0.0_wp, frequency, wp), work%stiffness)
    call matrix%factor(frequency, work%stiffness, work%band, singular)
    if (singular) call matrix%factor(frequency * (1.0_wp + beside), work%stiffness, work%band, singular)
    work%band%x(:) = (0.0_wp, 0.0_wp)
    call add_sources(matrix, sources, work)
    call matrix%solve(work%band)
  end subroutine solve_line

  !> The forces of some harmonics, and their twists in series.
  pure subroutine add_sources(matrix, sources, work)
    type(dynamic_stiffness_t), intent(in) :: matrix
    type(source_t), intent(in) :: sources(:)
    type(line_work_t), intent(inout) :: work
    integer :: i

    work%series(:) = (0.0_wp, 0.0_wp)
    do i = 1, size(sources)
      associate (e => sources(i)%element, amplitude => sources(i)%moment)
        if (sources(i)%is_twist) then
          work%series(e) = work%series(e) + amplitude
          call matrix%add_twist(e, work%stiffness(e), amplitude, work%band)
        else
          call matrix%add_forces(e, amplitude, work%band)
        end if
      end associate
    end do
  end subroutine add_sources

  !> The twist of an element without that in series, and its moment, after `solve_line`.
  pure subroutine find_twist(matrix, element, work, twist, moment)
    type(dynamic_stiffness_t), intent(in) :: matrix
    integer, intent(in) :: element
    type(line_work_t), intent(in) :: work
    complex(wp), intent(out) :: twist    !! [rad]
    complex(wp), intent(out) :: moment   !! [N m]

    call matrix%find_moment(element, work%stiffness(element), work%series(element), work%band, twist, moment)
  end subroutine find_twist

  !> The mean power that an element loses at a frequency [W].
  pure real(wp) function lost_power(frequency, stiffness, twist) result(power)
    real(wp), intent(in) :: frequency         !! [rad/s]
    complex(wp), intent(in) :: stiffness      !! [N m/rad]
    complex(wp), intent(in) :: twist          !! amplitude [rad]

    power = 0.5_wp * frequency * aimag(stiffness) * (real(twist, wp)**2 + aimag(twist)**2)
  end function lost_power

end module nocdyn_excitation_lines
