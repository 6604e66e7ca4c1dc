!> How far a forced response is within the range in which the laws of its elements are linear.
!>
!> A law M(u, u') that oscillates by u = u_0 + a cos(theta) has the equivalent stiffness -1 / (pi a) times the integral of
!> M cos(theta) over a turn: its first harmonic (describing function). It is compared with the tangent stiffness of the linear
!> response. The equivalent damping, from the same integral over an oscillation of u', is compared with the tangent damping. The
!> amplitude a of several lines is half the range of their sum.
module nocdyn_linear_ranges
  use nocdyn_bank, only: bank_t, role_coupling, role_load, role_motor
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t, new_machine_state
  use nocdyn_moment_forms, only: kind_moment, kind_reaction, moment_form_t
  use nocdyn_response_points, only: response_point_t
  implicit none (type, external)
  private

  public :: curved_elements, find_excursions, is_compared

  integer, parameter :: samples = 96   ! of half a turn: the share of a kink is right to some per cent
  real(wp), parameter :: pi = acos(-1.0_wp)

  !> An element that oscillates beyond the range of its linear law: where it is worst, and at how many points it does.
  type, public :: excursion_t
    integer :: element = 0
    integer :: points = 0
    integer :: worst = 0                     !! point
    logical :: is_elastic = .true.           !! whether the stiffness changes, else the damping
    real(wp) :: tangent = 0.0_wp             !! stiffness [N m/rad] or damping [N m s/rad] of the linear response there
    real(wp) :: equivalent = 0.0_wp          !! equivalent stiffness or damping over the oscillation
    real(wp) :: amplitude = 0.0_wp           !! of the oscillation [rad] or [rad/s]
    real(wp), private :: size = 0.0_wp       !! what makes a point worse than another one
  end type excursion_t

contains

  !> Finds the elements whose stiffness changes by more than a share over their oscillation, and those whose damping does so much
  !> that it moves a moment of the share of the largest half range.
  subroutine find_excursions(response, share, excursions)
    type(forced_response_t), intent(in) :: response
    real(wp), intent(in) :: share
    type(excursion_t), allocatable, intent(out) :: excursions(:)
    type(machine_state_t) :: state
    type(excursion_t), allocatable :: elastic(:), moving(:)
    integer, allocatable :: curved(:)
    integer :: i, k
    real(wp) :: t(1)

    t = response%held%balance%t
    associate (machine => response%held%balance%formulation%machine)
      state = new_machine_state(machine)
      allocate (curved, source=curved_elements(machine))
      allocate (elastic(size(curved)), moving(size(curved)))
      elastic%element = curved
      moving%element = curved
      moving%is_elastic = .false.
      if (size(curved) > 0) then
        do i = 1, size(response%points)
          call compare(response, i, machine, state, t, share, elastic)
          call compare(response, i, machine, state, t, share, moving)
        end do
      end if
    end associate
    excursions = [(pack(elastic(k:k), elastic(k:k)%points > 0), pack(moving(k:k), moving(k:k)%points > 0), k=1, size(curved))]
  end subroutine find_excursions

  !> The elements with laws that are not straight lines, without those with internal states.
  pure function curved_elements(machine) result(elements)
    type(machine_t), intent(in) :: machine
    integer, allocatable :: elements(:)
    integer :: cubic, e, i
    logical :: is_curved

    allocate (elements(0))
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        if (all(bank%role /= [role_coupling, role_load, role_motor]) .or. bank%states > 0) cycle
        is_curved = .not. bank%is_polynomial
        cubic = bank%number_of('cubic_stiffness')
        if (cubic > 0) is_curved = is_curved .or. any(abs(bank%parameters(cubic)%value) > 0)
        if (.not. is_curved) cycle
        elements = [elements, [(e, e=bank%first, bank%last())]]
      end associate
    end do
  end function curved_elements

  !> Compares all elements at one point.
  subroutine compare(response, point, machine, state, t, share, excursions)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: point
    type(machine_t), intent(in) :: machine             !! with mean torques
    type(machine_state_t), intent(inout) :: state      !! its elements are work space
    real(wp), contiguous, intent(in) :: t(:)
    real(wp), intent(in) :: share
    type(excursion_t), intent(inout) :: excursions(:)   !! all of stiffness or all of damping
    real(wp), parameter :: rounding = 1.0e-7_wp         ! of the moment at the mean
    real(wp), parameter :: negligible = 1.0e-6_wp       ! of another stiffness
    real(wp), dimension(size(excursions)) :: amplitude, equivalent, tangent
    real(wp) :: largest, moved, weight
    integer :: element(size(excursions)), k
    logical :: is_complete

    element = excursions%element
    associate (here => response%points(point), is_elastic => excursions(1)%is_elastic)
      do k = 1, size(excursions)
        amplitude(k) = oscillation(response, here, element(k), .not. is_elastic)
      end do
      state%elements%angle(1, :) = here%state%twist
      state%elements%speed(1, :) = here%state%rate
      call find_equivalent(machine, state, t, element, is_elastic, amplitude, equivalent, tangent)
      largest = largest_half_range(response%quantities, here)
      is_complete = size(response%left_out) == 0
      do k = 1, size(excursions)
        weight = 1.0_wp
        associate (bank => machine%banks(bank_number(machine, element(k)))%bank)
          if (bank%role == role_motor .and. here%state%factor > 0) weight = here%state%factor
        end associate
        moved = weight * abs(equivalent(k) - tangent(k)) * amplitude(k)
        if (moved <= rounding * abs(here%state%mean(element(k)))) cycle
        if (is_elastic) then
          if (abs(equivalent(k) - tangent(k)) <= share * abs(tangent(k))) cycle
          call keep_worst(abs(equivalent(k) - tangent(k)) / (abs(tangent(k)) + negligible * abs(equivalent(k) - tangent(k))))
        else
          if (moved <= share * largest) cycle
          call complete_largest()
          if (moved <= share * largest) cycle
          call keep_worst(moved)
        end if
      end do
    end associate
  contains
    !> The moments that are not computed count too.
    subroutine complete_largest()

      if (.not. is_complete) largest = max(largest, response%largest_left_out(response%points(point)))
      is_complete = .true.
    end subroutine complete_largest

    subroutine keep_worst(size)
      real(wp), intent(in) :: size

      associate (one => excursions(k))
        one%points = one%points + 1
        if (one%points > 1 .and. size <= one%size) return
        one%size = size
        one%worst = point
        one%amplitude = amplitude(k)
        one%equivalent = weight * equivalent(k)
        one%tangent = weight * tangent(k)
      end associate
    end subroutine keep_worst
  end subroutine compare

  !> The largest half range of the moments that are compared.
  pure real(wp) function largest_half_range(quantities, point) result(largest)
    type(moment_form_t), intent(in) :: quantities(:)
    type(response_point_t), intent(in) :: point
    integer :: q

    largest = 0.0_wp
    do q = 1, size(quantities)
      if (is_compared(quantities(q))) largest = max(largest, point%half_range(q))
    end do
  end function largest_half_range

  !> Whether the changes of other moments are compared with this one: moments of couplings and reactions.
  elemental logical function is_compared(quantity)
    type(moment_form_t), intent(in) :: quantity

    is_compared = quantity%kind == kind_moment .or. quantity%kind == kind_reaction
  end function is_compared

  pure integer function bank_number(machine, element) result(number)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: element

    do number = 1, size(machine%banks) - 1
      if (element <= machine%banks(number)%bank%last()) return
    end do
  end function bank_number

  !> Half the range of the twist of an element, without that in series, or of its rate.
  pure real(wp) function oscillation(response, point, element, is_rate) result(amplitude)
    type(forced_response_t), intent(in) :: response
    type(response_point_t), intent(in) :: point
    integer, intent(in) :: element
    logical, intent(in) :: is_rate
    complex(wp) :: twist(size(response%lines))
    real(wp) :: highest, lowest
    integer :: i, k, l

    twist = (0.0_wp, 0.0_wp)
    associate (rows => response%machine%elements%rows)
      do k = rows%first(element), rows%first(element + 1) - 1
        if (rows%body(k) > 0) twist = twist + rows%coefficient(k) * point%angle(:, response%angle_place(rows%body(k)))
      end do
    end associate
    do l = 1, size(twist)
      do i = 1, size(response%lines(l)%source)
        associate (source => point%sources(response%lines(l)%source(i)))
          if (source%is_twist .and. source%element == element) twist(l) = twist(l) - source%moment
        end associate
      end do
    end do
    if (is_rate) twist = twist * cmplx(0.0_wp, point%frequency, wp)
    call response%synthesis%extremes(twist, lowest, highest)
    amplitude = 0.5_wp * (highest - lowest)
  end function oscillation

  !> The slopes of the laws at the mean, and the ones of the first harmonics over the oscillations.
  subroutine find_equivalent(machine, state, t, element, is_elastic, amplitude, equivalent, tangent)
    type(machine_t), intent(in) :: machine
    type(machine_state_t), intent(inout) :: state   !! at its mean
    real(wp), contiguous, intent(in) :: t(:)
    integer, intent(in) :: element(:)
    logical, intent(in) :: is_elastic
    real(wp), intent(in) :: amplitude(:)
    real(wp), intent(out) :: equivalent(:), tangent(:)
    real(wp) :: mean(size(element)), moment(size(element))
    integer :: i

    call state%choose_branches(machine, t)
    call state%evaluate_elements(machine, t)
    call state%differentiate_elements(machine, t)
    if (is_elastic) then
      tangent = -(state%elements%restoring_angle(1, element) + state%elements%applied_angle(1, element))
      mean = state%elements%angle(1, element)
    else
      tangent = -state%elements%applied_speed(1, element)
      mean = state%elements%speed(1, element)
    end if
    equivalent = 0.0_wp
    do i = 1, samples
      associate (wave => cos(pi * (i - 0.5_wp) / samples))
        if (is_elastic) state%elements%angle(1, element) = mean + amplitude * wave
        if (.not. is_elastic) state%elements%speed(1, element) = mean + amplitude * wave
        call state%choose_branches(machine, t)
        call state%evaluate_elements(machine, t)
        moment = state%elements%restoring(1, element) + state%elements%applied(1, element)
        equivalent = equivalent - moment * wave
      end associate
    end do
    where (amplitude > tiny(1.0_wp))
      equivalent = 2.0_wp / samples * equivalent / amplitude
    else where
      equivalent = tangent
    end where
  end subroutine find_equivalent

end module nocdyn_linear_ranges
