!> The terms that the laws of the elements have in at least one lane of a block, so that kernels leave the others out.
!>
!> A term stays once a lane has had it. That changes no bits, as a term with the coefficient zero adds zero.
module nocdyn_lane_terms
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  implicit none (type, external)
  private

  public :: is_polynomial_or_external, new_lane_terms

  !> Every array has the shape [elements].
  type, public :: lane_terms_t
    logical, allocatable :: is_time_only(:)   !! whether the moment depends on the time alone
    logical, allocatable :: has_angle(:)      !! whether there is a restoring moment
    logical, allocatable :: has_cubic(:)      !! whether there is a cubic restoring moment
    logical, allocatable :: has_speed(:)      !! whether the applied moment depends on the speed
    logical, allocatable :: has_square(:)     !! whether the applied moment depends on the square of the speed
  contains
    procedure :: add_lane_terms
  end type lane_terms_t

contains

  !> Whether all laws of a machine are polynomials or depend on the time alone.
  pure logical function is_polynomial_or_external(machine)
    type(machine_t), intent(in) :: machine
    integer :: i

    is_polynomial_or_external = .false.
    if (machine%elements%internal%count > 0) return
    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank)
        if (.not. bank%is_time_only) return
        associate (first => bank%first, last => bank%last(), laws => machine%laws)
          if (any(abs(laws%linear(:, first:last)) + abs(laws%cubic(:, first:last)) > 0)) return
          if (any(abs(laws%by_speed(:, first:last)) + abs(laws%by_speed_squared(:, first:last)) > 0)) return
        end associate
      end associate
    end do
    is_polynomial_or_external = .true.
  end function is_polynomial_or_external

  !> The terms of a machine of that kind.
  function new_lane_terms(machine) result(self)
    type(machine_t), intent(in) :: machine
    type(lane_terms_t) :: self
    integer :: i, lane

    allocate (self%is_time_only(size(machine%elements%to)), source=.false.)
    allocate (self%has_angle, self%has_cubic, self%has_speed, self%has_square, source=self%is_time_only)
    do i = 1, size(machine%general_banks)
      associate (bank => machine%banks(machine%general_banks(i))%bank)
        self%is_time_only(bank%first:bank%last()) = .true.
      end associate
    end do
    do lane = 1, machine%lanes
      call self%add_lane_terms(machine, lane)
    end do
  end function new_lane_terms

  !> Adds the terms of the present parameters of a lane.
  pure subroutine add_lane_terms(self, machine, lane)
    class(lane_terms_t), intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: lane
    integer :: e

    associate (laws => machine%laws)
      do e = 1, size(self%is_time_only)
        if (abs(laws%cubic(lane, e)) > 0) self%has_cubic(e) = .true.
        if (abs(laws%linear(lane, e)) > 0 .or. self%has_cubic(e)) self%has_angle(e) = .true.
        if (abs(laws%by_speed_squared(lane, e)) > 0) self%has_square(e) = .true.
        if (abs(laws%by_speed(lane, e)) > 0 .or. self%has_square(e)) self%has_speed(e) = .true.
      end do
    end associate
  end subroutine add_lane_terms

end module nocdyn_lane_terms
