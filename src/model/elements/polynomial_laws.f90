!> The polynomial parts of the laws of all elements, evaluated in vector loops over all banks.
!>
!> restoring = -(linear + cubic w^2) w with w = u - rest, applied = constant + (by_speed + by_speed_squared u') u'.
!>
!> Large machines spend their time on reading the coefficients. A plain spring, which has no rest angle, constant or
!> by_speed_squared, needs linear, cubic and by_speed only: in long runs of plain springs no other coefficients are read.
module nocdyn_polynomial_laws
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  implicit none (type, external)
  private

  public :: new_polynomial_laws

  !> Names of the coefficients.
  integer, parameter, public :: coefficient_rest = 1, coefficient_linear = 2, coefficient_cubic = 3, coefficient_constant = 4
  integer, parameter, public :: coefficient_by_speed = 5, coefficient_by_speed_squared = 6

  !> The coefficients of all elements, shape [lanes, elements]; zero where a law has no such term.
  type, public :: polynomial_laws_t
    real(wp), allocatable :: rest(:, :)               !! [rad]
    real(wp), allocatable :: linear(:, :)             !! [N m/rad]
    real(wp), allocatable :: cubic(:, :)              !! [N m/rad3]
    real(wp), allocatable :: constant(:, :)           !! [N m]
    real(wp), allocatable :: by_speed(:, :)           !! [N m s/rad]
    real(wp), allocatable :: by_speed_squared(:, :)   !! [N m s2/rad2]
    integer, private :: values = 0                    !! lanes * elements
    logical, private :: is_divided = .false.          !! whether some parts are plain springs
    integer, private :: parts = 0
    integer, allocatable, private :: first(:)         !! first element of each part, [parts + 1]
    logical, allocatable, private :: is_plain(:)      !! whether all elements of a part are plain springs; before part 1: true
  contains
    procedure :: set
    procedure :: find_plain_parts
    procedure :: refresh_lane
    procedure :: pass_parameters
    procedure :: evaluate
    procedure :: differentiate
    procedure :: evaluate_energies
  end type polynomial_laws_t

  integer, parameter :: short = 64   ! fewer values [lanes, elements] are not worth a loop of their own

contains

  !> Laws without any moment.
  function new_polynomial_laws(lanes, elements) result(self)
    integer, intent(in) :: lanes, elements
    type(polynomial_laws_t) :: self

    allocate (self%rest(lanes, elements), source=0.0_wp)
    allocate (self%linear, self%cubic, self%constant, self%by_speed, self%by_speed_squared, source=self%rest)
    self%values = lanes * elements
    allocate (self%first(elements + 1), source=1)
    allocate (self%is_plain(0:elements), source=.true.)
  end function new_polynomial_laws

  !> Sets a coefficient of an element in one lane.
  pure subroutine set(self, coefficient, lane, element, value)
    class(polynomial_laws_t), intent(inout) :: self
    integer, intent(in) :: coefficient   !! coefficient_...
    integer, intent(in) :: lane, element
    real(wp), intent(in) :: value        !! in the unit of the coefficient

    select case (coefficient)
    case (coefficient_rest)
      self%rest(lane, element) = value
    case (coefficient_linear)
      self%linear(lane, element) = value
    case (coefficient_cubic)
      self%cubic(lane, element) = value
    case (coefficient_constant)
      self%constant(lane, element) = value
    case (coefficient_by_speed)
      self%by_speed(lane, element) = value
    case (coefficient_by_speed_squared)
      self%by_speed_squared(lane, element) = value
    case default
      error stop 'nocdyn_polynomial_laws: no such coefficient'
    end select
  end subroutine set

  !> Divides the elements into long runs of plain springs and the others. To be called when the coefficients are set.
  subroutine find_plain_parts(self)
    class(polynomial_laws_t), intent(inout) :: self
    integer :: e, run
    logical :: is_long

    self%parts = 0
    e = 1
    do while (e <= size(self%rest, 2))
      run = plain_run(self, e)
      is_long = size(self%rest, 1) * run >= short
      if (is_long .or. self%is_plain(self%parts)) then
        self%parts = self%parts + 1
        self%first(self%parts) = e
        self%is_plain(self%parts) = is_long
      end if
      e = e + max(run, 1)
    end do
    self%first(self%parts + 1) = e
    self%is_divided = any(self%is_plain(1:self%parts))
  end subroutine find_plain_parts

  !> Divides the elements again if a lane has new parameters by which an element of a plain part is no plain spring any more.
  subroutine refresh_lane(self, lane)
    class(polynomial_laws_t), intent(inout) :: self
    integer, intent(in) :: lane   !! that has new parameters
    integer :: e, part

    if (.not. self%is_divided) return
    do part = 1, self%parts
      if (.not. self%is_plain(part)) cycle
      do e = self%first(part), self%first(part + 1) - 1
        if (is_plain_in(self, lane, e)) cycle
        call self%find_plain_parts()
        return
      end do
    end do
  end subroutine refresh_lane

  !> Whether an element is a plain spring in one lane.
  pure logical function is_plain_in(self, lane, element)
    type(polynomial_laws_t), intent(in) :: self
    integer, intent(in) :: lane, element

    is_plain_in = .not. (abs(self%rest(lane, element)) > 0 .or. abs(self%constant(lane, element)) > 0 .or. &
                        abs(self%by_speed_squared(lane, element)) > 0)
  end function is_plain_in

  subroutine pass_parameters(self, parameters)
    class(polynomial_laws_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add('laws: rest', self%rest)
    call parameters%add('laws: linear', self%linear)
    call parameters%add('laws: cubic', self%cubic)
    call parameters%add('laws: constant', self%constant)
    call parameters%add('laws: by_speed', self%by_speed)
    call parameters%add('laws: by_speed_squared', self%by_speed_squared)
  end subroutine pass_parameters

  !> Number of consecutive elements from `first` on that are plain springs in all lanes.
  pure integer function plain_run(self, first)
    type(polynomial_laws_t), intent(in) :: self
    integer, intent(in) :: first   !! element
    integer :: e, l

    plain_run = 0
    do e = first, size(self%rest, 2)
      do l = 1, size(self%rest, 1)
        if (.not. is_plain_in(self, l, e)) return
      end do
      plain_run = plain_run + 1
    end do
  end function plain_run

  !> Sets the moments of all elements: eqs. (3), (49), (50) as restoring moments; eqs. (5) and (20) as applied ones.
  subroutine evaluate(self, elements)
    class(polynomial_laws_t), intent(in) :: self
    type(element_values_t), intent(inout) :: elements   !! angles and speeds are set
    integer :: part

    if (self%is_divided) then
      do part = 1, self%parts
        associate (e => self%first(part), n => size(self%rest, 1) * (self%first(part + 1) - self%first(part)))
          if (self%is_plain(part)) then
            call plain_moments(n, self%linear(1, e), self%cubic(1, e), self%by_speed(1, e), elements%angle(1, e), &
                              elements%speed(1, e), elements%restoring(1, e), elements%applied(1, e))
          else
            call moments(n, self%rest(1, e), self%linear(1, e), self%cubic(1, e), self%constant(1, e), self%by_speed(1, e), &
                         self%by_speed_squared(1, e), elements%angle(1, e), elements%speed(1, e), elements%restoring(1, e), &
                         elements%applied(1, e))
          end if
        end associate
      end do
    else
      call moments(self%values, self%rest, self%linear, self%cubic, self%constant, self%by_speed, self%by_speed_squared, &
                   elements%angle, elements%speed, elements%restoring, elements%applied)
    end if
  end subroutine evaluate

  pure subroutine moments(n, rest, linear, cubic, constant, by_speed, by_speed_squared, angle, speed, restoring, applied)
    integer, intent(in) :: n   !! values of the part
    real(wp), intent(in), dimension(n) :: rest, linear, cubic, constant, by_speed, by_speed_squared, angle, speed
    real(wp), intent(inout) :: restoring(n), applied(n)
    real(wp) :: w
    integer :: i

    do i = 1, n
      w = angle(i) - rest(i)
      restoring(i) = -(linear(i) + cubic(i) * w * w) * w
      applied(i) = constant(i) + (by_speed(i) + by_speed_squared(i) * speed(i)) * speed(i)
    end do
  end subroutine moments

  !> Moments of springs without a constant, in the bits of `moments`: the added zero makes -0 a +0, as the constant does there.
  pure subroutine plain_moments(n, linear, cubic, by_speed, angle, speed, restoring, applied)
    integer, intent(in) :: n   !! values of the part
    real(wp), intent(in), dimension(n) :: linear, cubic, by_speed, angle, speed
    real(wp), intent(inout) :: restoring(n), applied(n)
    integer :: i

    do i = 1, n
      restoring(i) = -(linear(i) + cubic(i) * angle(i) * angle(i)) * angle(i)
      applied(i) = 0.0_wp + by_speed(i) * speed(i)
    end do
  end subroutine plain_moments

  !> Sets the derivatives of the moments; `restoring_angle` is minus the tangent stiffness K1 + 3 k1 w^2 of eqs. (64)-(68).
  subroutine differentiate(self, elements)
    class(polynomial_laws_t), intent(in) :: self
    type(element_values_t), intent(inout) :: elements
    real(wp) :: w
    integer :: e, l

    do e = 1, size(self%rest, 2)
      do l = 1, size(self%rest, 1)
        w = elements%angle(l, e) - self%rest(l, e)
        elements%restoring_angle(l, e) = -(self%linear(l, e) + 3.0_wp * self%cubic(l, e) * w * w)
        elements%restoring_curvature(l, e) = -6.0_wp * self%cubic(l, e) * w
        elements%applied_angle(l, e) = 0.0_wp
        elements%applied_speed(l, e) = self%by_speed(l, e) + 2.0_wp * self%by_speed_squared(l, e) * elements%speed(l, e)
        elements%applied_time(l, e) = 0.0_wp
      end do
    end do
  end subroutine differentiate

  !> Sets the stored energies linear w^2 / 2 + cubic w^4 / 4.
  subroutine evaluate_energies(self, elements)
    class(polynomial_laws_t), intent(in) :: self
    type(element_values_t), intent(inout) :: elements

    call energies(self%values, self%rest, self%linear, self%cubic, elements%angle, elements%stored)
  end subroutine evaluate_energies

  pure subroutine energies(n, rest, linear, cubic, angle, stored)
    integer, intent(in) :: n   !! values
    real(wp), intent(in), dimension(n) :: rest, linear, cubic, angle
    real(wp), intent(inout) :: stored(n)
    real(wp) :: w2
    integer :: i

    do i = 1, n
      w2 = (angle(i) - rest(i))**2
      stored(i) = (0.5_wp * linear(i) + 0.25_wp * cubic(i) * w2) * w2
    end do
  end subroutine energies

end module nocdyn_polynomial_laws
