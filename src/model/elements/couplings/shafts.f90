!> Elastic shafts: uniform segments of spectral elements (`nocdyn_spectral_elements`), whose internal nodes are bodies.
!>
!> Each Gauss point of a segment is an element of the bank, a slice: its angle is the twist of the part of the shaft that it
!> stands for, and its moment the one of the shaft there. Between the Gauss points of a segment the moment is a polynomial.
module nocdyn_shafts
  use nocdyn_couplings, only: coupling_common_t, couplings_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: coefficient_linear, coefficient_rest
  use nocdyn_quantities, only: form_observed, new_quantity, quantity_t, rank_moment, rank_stress, rank_torque, rank_twist
  implicit none (type, external)
  private

  public :: new_shafts

  !> A spectral element: a uniform part of a shaft.
  type, public :: shaft_element_t
    integer, allocatable :: bodies(:)   !! its nodes from end to end, 0 = ground
    real(wp) :: stiffness = 0.0_wp      !! [N m/rad]
    real(wp) :: inertia = 0.0_wp        !! [kg m2]
  end type shaft_element_t

  !> The slices of a shaft, and its moments at points along it, from end to end, two at every step of the diameter. Slices are
  !> numbered within the bank, and points over all of its shafts.
  type, public :: shaft_t
    integer :: first = 1, last = 0               !! slices
    integer :: first_point = 1, last_point = 0
    integer, allocatable :: ends(:)              !! its two bodies, 0 = ground
    type(shaft_element_t), allocatable :: elements(:)   !! none if it has no inertia
    real(wp), allocatable :: moments(:, :)       !! moments at the points from the ones of the slices there, [most slices, points]
    integer, allocatable :: before(:)            !! slices of the shaft before these, [points]
    integer, allocatable :: slices(:)            !! their number, [points]
  contains
    procedure :: all_moments
  end type shaft_t

  type, extends(couplings_t), public :: shafts_t
    type(shaft_t), allocatable :: shafts(:)
  contains
    procedure :: quantities
    procedure :: observe
    procedure :: positions, section_moduli, moment_at
    procedure, nopass :: is_largest_moment, is_stress
  end type shafts_t

  ! the order of `quantities`
  integer, parameter :: twist = 1, moment_1 = 2, moment_2 = 3, largest_moment = 4, stress = 5, power = 6

contains

  !> The moments at the points from the ones of all slices, [points, slices].
  pure function all_moments(self) result(moments)
    class(shaft_t), intent(in) :: self
    real(wp), allocatable :: moments(:, :)
    integer :: p

    allocate (moments(size(self%before), self%last - self%first + 1), source=0.0_wp)
    do p = 1, size(self%before)
      moments(p, self%before(p) + 1:self%before(p) + self%slices(p)) = self%moments(:self%slices(p), p)
    end do
  end function all_moments

  !> A bank of shafts. All slices of a shaft have its name.
  function new_shafts(common, stiffness, shafts, position, section_modulus) result(bank)
    type(coupling_common_t), intent(in) :: common      !! names, rows, damping, rest twists of the slices
    real(wp), intent(in) :: stiffness(:, :)            !! [N m/rad], [lanes, slices]
    type(shaft_t), intent(in) :: shafts(:)
    real(wp), intent(in) :: position(:, :)             !! of the points from the first end [m], [lanes, points]
    real(wp), intent(in) :: section_modulus(:, :)      !! against torsion [m3], [lanes, points]
    type(shafts_t) :: bank
    integer, allocatable :: owner(:)
    integer :: s

    call bank%set_common(common)
    allocate (bank%shafts, source=shafts)
    allocate (owner, source=[(spread(shafts(s)%first, 1, shafts(s)%last_point - shafts(s)%first_point + 1), s=1, size(shafts))])
    call bank%add_parameter('slice_stiffness', stiffness, is_key=.false.)
    call bank%add_parameter('position', position, is_key=.false., element=owner)
    call bank%add_parameter('shaft_modulus', section_modulus, is_key=.false., element=owner)
    call bank%add_term('rest_twist', coefficient_rest, 1.0_wp)
    call bank%add_term('slice_stiffness', coefficient_linear, 1.0_wp)
    call bank%add_damping()
    bank%is_polynomial = .true.
    bank%has_polynomial_potential = .true.
    bank%has_paper_law = .true.
    bank%has_parts = .true.
    call bank%prepare_law()
  end function new_shafts

  !> Twist of each shaft, its moments at both ends, the largest moment and stress along it, and the power through it.
  subroutine quantities(self, columns)
    class(shafts_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    character(len=*), parameter :: at_end = 'moment at an end of the shaft', with = 'with the twist'
    integer :: first(size(self%shafts)), s

    allocate (columns(power))
    first = self%shafts%first
    columns(twist) = new_quantity('twist', 'rad', first, 'twist', 'if the second end is ahead', rank_twist, form_observed, &
                                  1.0_wp)
    columns(moment_1) = new_quantity('total_moment', 'N m', first, at_end, with, rank_moment, &
                                     form_observed, 1.0_wp)
    columns(moment_2) = new_quantity('total_moment', 'N m', first, at_end, with, rank_moment, &
                                     form_observed, 1.0_wp)
    columns(largest_moment) = new_quantity('total_moment', 'N m', first, 'largest moment along the shaft', with, &
                                           rank_moment, form_observed, 1.0_wp)
    columns(stress) = new_quantity('stress', 'Pa', first, 'largest shear stress along the shaft', with, rank_stress, &
                                   form_observed, 1.0_wp)
    columns(power) = new_quantity('power', 'W', first, 'power through the shaft', 'from the first end to the second', &
                                  rank_torque, form_observed, 1.0_wp)
    allocate (columns(power)%body(size(self%shafts)))
    do s = 1, size(self%shafts)   ! at the second end if the first one is held
      columns(power)%body(s) = merge(self%shafts(s)%ends(1), self%shafts(s)%ends(2), self%shafts(s)%ends(1) > 0)
    end do
    columns(moment_1)%point = '1'
    columns(moment_2)%point = '2'
    columns(largest_moment)%point = 'max'
  end subroutine quantities

  !> Whether a quantity is the largest moment along a shaft.
  pure logical function is_largest_moment(quantity)
    integer, intent(in) :: quantity   !! index in `quantities`

    is_largest_moment = quantity == largest_moment
  end function is_largest_moment

  !> Whether a quantity is the largest stress along a shaft.
  pure logical function is_stress(quantity)
    integer, intent(in) :: quantity   !! index in `quantities`

    is_stress = quantity == stress
  end function is_stress

  !> The twist of the second end against the first one [rad], the moment in the shaft [N m], elastic and of its damping, positive
  !> with the twist, the shear stress at the surface [Pa], and the moment that a speed multiplies to the power [N m]. The values
  !> of a shaft are the ones of its first slice.
  pure subroutine observe(self, elements, quantity, lane, values)
    class(shafts_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: quantity   !! twist ... stress
    integer, intent(in) :: lane
    real(wp), intent(out) :: values(:)   !! [elements of the bank]
    real(wp) :: found
    integer :: modulus, p, s

    values = 0.0_wp
    modulus = self%number_of('shaft_modulus')
    do s = 1, size(self%shafts)
      associate (shaft => self%shafts(s), value => values(self%shafts(s)%first), offset => self%first - 1)
        if (quantity == twist) then
          value = sum(elements%angle(lane, offset + shaft%first:offset + shaft%last))
          cycle
        end if
        do p = 1, size(shaft%moments, 2)
          if (any(quantity == [moment_1, moment_2, power]) .and. p /= end_point(shaft, quantity)) cycle
          found = self%moment_at(elements, s, p, lane)
          if (quantity == power) found = -found
          if (quantity == stress) found = found / self%parameters(modulus)%value(lane, shaft%first_point + p - 1)
          if (abs(found) > abs(value)) value = found
        end do
      end associate
    end do
  end subroutine observe

  !> The point of an end. The power is that at the first end, or at the second one if the first is held.
  pure integer function end_point(shaft, quantity)
    type(shaft_t), intent(in) :: shaft
    integer, intent(in) :: quantity   !! moment_1, moment_2 or power

    end_point = 1
    if (quantity == moment_2 .or. quantity == power .and. shaft%ends(1) == 0) end_point = size(shaft%moments, 2)
  end function end_point

  !> The moment at a point of a shaft, elastic and of its damping [N m], after `evaluate`.
  pure real(wp) function moment_at(self, elements, shaft, point, lane) result(moment)
    class(shafts_t), intent(in) :: self
    type(element_values_t), intent(in) :: elements
    integer, intent(in) :: shaft, point, lane

    associate (one => self%shafts(shaft), first => self%first - 1 + self%shafts(shaft)%first + self%shafts(shaft)%before(point), &
               n => self%shafts(shaft)%slices(point))
      moment = 0.0_wp - sum(one%moments(:n, point) * (elements%restoring(lane, first:first + n - 1) &
                                                      + elements%applied(lane, first:first + n - 1)))
    end associate
  end function moment_at

  !> Distances of the points of a shaft from its first end [m], [points].
  pure function positions(self, shaft, lane)
    class(shafts_t), intent(in) :: self
    integer, intent(in) :: shaft, lane
    real(wp) :: positions(self%shafts(shaft)%last_point - self%shafts(shaft)%first_point + 1)

    associate (one => self%shafts(shaft))
      positions = self%parameters(self%number_of('position'))%value(lane, one%first_point:one%last_point)
    end associate
  end function positions

  !> Section moduli against torsion at the points of a shaft [m3], [points].
  pure function section_moduli(self, shaft, lane)
    class(shafts_t), intent(in) :: self
    integer, intent(in) :: shaft, lane
    real(wp) :: section_moduli(self%shafts(shaft)%last_point - self%shafts(shaft)%first_point + 1)

    associate (one => self%shafts(shaft))
      section_moduli = self%parameters(self%number_of('shaft_modulus'))%value(lane, one%first_point:one%last_point)
    end associate
  end function section_moduli

end module nocdyn_shafts
