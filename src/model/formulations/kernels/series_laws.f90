!> The polynomial laws of the elements in the layout of the Taylor series: whole vectors, with lists of those with higher terms.
module nocdyn_series_laws
  use nocdyn_kinds, only: wp
  use nocdyn_polynomial_laws, only: polynomial_laws_t
  implicit none (type, external)
  private

  public :: new_series_laws

  integer, parameter, public :: width = 4   !! values of a vector

  !> Every array holds the lanes of the first element, then those of the second, and so on, and is padded with zeros.
  type, public :: series_laws_t
    real(wp), allocatable :: rest(:)   !! as in `polynomial_laws_t`
    real(wp), allocatable :: linear(:)
    real(wp), allocatable :: cubic(:)
    real(wp), allocatable :: constant(:)
    real(wp), allocatable :: by_speed(:)
    real(wp), allocatable :: by_speed_squared(:)
    integer, allocatable :: cubic_vectors(:)         !! first values of the vectors with terms in (u - rest)^3
    integer, allocatable :: square_vectors(:)        !! first values of the vectors with terms in u'^2
    logical, allocatable, private :: has_cubic(:)    !! of each vector
    logical, allocatable, private :: has_square(:)   !! of each vector
  contains
    procedure :: refresh_lane
  end type series_laws_t

contains

  !> Copies the laws.
  function new_series_laws(stride, laws) result(self)
    integer, intent(in) :: stride   !! length of the arrays, whole vectors
    type(polynomial_laws_t), intent(in) :: laws
    type(series_laws_t) :: self
    integer :: lane

    allocate (self%rest(stride), source=0.0_wp)
    allocate (self%linear, self%cubic, self%constant, self%by_speed, self%by_speed_squared, source=self%rest)
    do lane = 1, size(laws%rest, 1)
      call copy_lane(lane, laws, self)
    end do
    call find_term_vectors(self)
  end function new_series_laws

  !> Copies the parameters of a lane.
  subroutine refresh_lane(self, lane, laws)
    class(series_laws_t), intent(inout) :: self
    integer, intent(in) :: lane
    type(polynomial_laws_t), intent(in) :: laws

    call copy_lane(lane, laws, self)
    if (has_new_terms(self, lane, size(laws%rest, 1))) call find_term_vectors(self)
  end subroutine refresh_lane

  !> Copies the parameters of a lane, without the lists.
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
  pure logical function has_new_terms(self, lane, lanes)
    type(series_laws_t), intent(in) :: self
    integer, intent(in) :: lane, lanes
    integer :: i, v

    has_new_terms = .true.
    do i = lane, size(self%cubic), lanes
      v = (i - 1) / width + 1
      if (abs(self%cubic(i)) > 0 .and. .not. self%has_cubic(v)) return
      if (abs(self%by_speed_squared(i)) > 0 .and. .not. self%has_square(v)) return
    end do
    has_new_terms = .false.
  end function has_new_terms

  !> Lists the vectors with terms of higher degree.
  subroutine find_term_vectors(self)
    type(series_laws_t), intent(inout) :: self
    integer :: i

    self%has_cubic = [(any(abs(self%cubic(i:i + width - 1)) > 0), i=1, size(self%cubic), width)]
    self%has_square = [(any(abs(self%by_speed_squared(i:i + width - 1)) > 0), i=1, size(self%cubic), width)]
    self%cubic_vectors = pack([(i, i=1, size(self%cubic), width)], self%has_cubic)
    self%square_vectors = pack([(i, i=1, size(self%cubic), width)], self%has_square)
  end subroutine find_term_vectors

end module nocdyn_series_laws
