!> The polynomial laws of elements as the Taylor series of the motion uses them: whole vectors, and which have higher terms.
module nocdyn_series_laws
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: new_series_laws

  integer, parameter, public :: width = 4   !! of a vector

  !> Every array of numbers holds the lanes of the first element, then those of the second, and so on, and zeros at its end.
  type, public :: series_laws_t
    real(wp), allocatable :: rest(:)               !! as in `polynomial_laws_t`
    real(wp), allocatable :: linear(:)
    real(wp), allocatable :: cubic(:)
    real(wp), allocatable :: constant(:)
    real(wp), allocatable :: by_speed(:)
    real(wp), allocatable :: by_speed_squared(:)
    integer, allocatable :: cubed(:)               !! first values of the vectors with terms by (u - rest)^3
    integer, allocatable :: squared(:)             !! first values of the vectors with terms by u'^2
    logical, allocatable, private :: is_cubed(:)   !! of each vector
    logical, allocatable, private :: is_squared(:)
  contains
    procedure :: take_lane
  end type series_laws_t

contains

  !> The laws in arrays of so many numbers.
  function new_series_laws(stride, laws) result(self)
    integer, intent(in) :: stride   !! whole vectors
    type(polynomial_laws_t), intent(in) :: laws
    type(series_laws_t) :: self
    integer :: lane

    allocate (self%rest(stride), source=0.0_wp)
    allocate (self%linear, self%cubic, self%constant, self%by_speed, self%by_speed_squared, source=self%rest)
    do lane = 1, size(laws%rest, 1)
      call copy_lane(lane, laws, self)
    end do
    call find_strips(self)
  end function new_series_laws

  !> Takes the numbers that a lane has now.
  subroutine take_lane(self, lane, laws)
    class(series_laws_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws

    call copy_lane(lane, laws, self)
    if (needs_other_strips(self, lane, size(laws%rest, 1))) call find_strips(self)
  end subroutine take_lane

  subroutine copy_lane(lane, laws, self)
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws
    type(series_laws_t), intent(inout) :: self
    integer :: e, i

    i = lane
    do e = 1, size(laws%rest, 2)
      self%rest(i) = laws%rest(lane, e)
      self%linear(i) = laws%linear(lane, e)
      self%cubic(i) = laws%cubic(lane, e)
      self%constant(i) = laws%constant(lane, e)
      self%by_speed(i) = laws%by_speed(lane, e)
      self%by_speed_squared(i) = laws%by_speed_squared(lane, e)
      i = i + size(laws%rest, 1)
    end do
  end subroutine copy_lane

  !> Whether a lane has terms of higher degree in vectors that had none.
  pure logical function needs_other_strips(self, lane, lanes)
    type(series_laws_t), intent(in) :: self
    integer, intent(in) :: lane, lanes
    integer :: i, v

    needs_other_strips = .true.
    do i = lane, size(self%cubic), lanes
      v = (i - 1) / width + 1
      if (abs(self%cubic(i)) > 0 .and. .not. self%is_cubed(v)) return
      if (abs(self%by_speed_squared(i)) > 0 .and. .not. self%is_squared(v)) return
    end do
    needs_other_strips = .false.
  end function needs_other_strips

  !> Finds the vectors with terms of higher degree.
  subroutine find_strips(self)
    type(series_laws_t), intent(inout) :: self
    integer :: i

    self%is_cubed = [(any(abs(self%cubic(i:i + width - 1)) > 0), i=1, size(self%cubic), width)]
    self%is_squared = [(any(abs(self%by_speed_squared(i:i + width - 1)) > 0), i=1, size(self%cubic), width)]
    self%cubed = pack([(i, i=1, size(self%cubic), width)], self%is_cubed)
    self%squared = pack([(i, i=1, size(self%cubic), width)], self%is_squared)
  end subroutine find_strips

end module nocdyn_series_laws
