!> The moments of joints, teeth with losses among them, whose modes are chosen, and whether they agree with these.
!>
!> With the modes of all joints chosen, their moments x follow from linear equations: no acceleration where a joint is locked, the
!> moment of slip where one slips, and x = -s (T + V x) where teeth turn. The modes are right if each moment, acceleration and
!> torque T agrees with its mode. Rounding errors are measured by the terms of each row, and by the largest ones of all rows: the
!> moments come from equations that mix them.
module nocdyn_joint_problem
  use nocdyn_friction_joints, only: direction_of, driven_backwards, driven_forwards, first_wheel_drives, locked, &
    slips_backwards, slips_forwards
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_semidefinite, only: null_tolerance
  use nocdyn_tooth_loads, only: mixed
  implicit none (type, external)
  private

  real(wp), parameter, public :: inconsistent = 1.0e-7_wp   !! acceleration of a lock that others do not allow, relative to its
                                                            !! terms
  real(wp), parameter, public :: flexibility = 1.0e-9_wp    !! of locks that may be redundant, relative to the diagonal of W

  type, public :: joint_problem_t
    real(wp), allocatable :: w(:, :)           !! accelerations by the moments [1/(kg m2)], [joints, joints]
    real(wp), allocatable :: rate(:)           !! accelerations without them [rad/s2], [joints] as all that follow
    logical, allocatable :: is_at_rest(:)
    real(wp), allocatable :: slip(:)           !! u' of the others [rad/s]
    real(wp), allocatable :: least(:), most(:) !! between which moments of friction are at rest [N m]
    real(wp), allocatable :: sliding(:, :)     !! moments of slip forwards and backwards [N m], [2, joints]
    logical, allocatable :: has_teeth(:)       !! whether these are teeth with losses
    real(wp), allocatable :: v(:, :)           !! T by the moments, [joints, joints]
    real(wp), allocatable :: load(:)           !! T without them [N m]
    real(wp), allocatable :: driving(:), driven(:)   !! the shares s of T that are lost if the first wheel drives or is driven
    real(wp) :: most_beyond = 0.0_wp           !! by which rounding errors may take moments beyond their bounds [N m]
    integer, allocatable :: mode(:)            !! as chosen
    real(wp), allocatable :: moment(:)         !! x [N m]
  contains
    procedure :: find_moments
    procedure :: better_modes
    procedure :: accelerations
    procedure :: is_contradicted
    procedure :: is_stable
    procedure :: holds_always
    procedure :: roots
    procedure :: share
    procedure :: scaled_equations
    procedure, private :: equations
    procedure, private :: better_teeth
    procedure, private :: better_friction
  end type joint_problem_t

  real(wp), parameter :: rounding = 1.0e-12_wp      ! of a torque, relative to its terms
  real(wp), parameter :: no_slip = 1.0e-10_wp       ! acceleration of a joint at its bound that others hold, likewise

contains

  !> Square roots of the diagonal of W: with moments times them and accelerations by them, all rows have one unit.
  pure function roots(self)
    class(joint_problem_t), intent(in) :: self
    real(wp) :: roots(size(self%mode))
    integer :: i

    roots = [(merge(sqrt(abs(self%w(i, i))), 1.0_wp, self%w(i, i) > 0), i=1, size(self%mode))]
  end function roots

  !> The share of T that is lost in the present mode of teeth.
  pure real(wp) function share(self, i)
    class(joint_problem_t), intent(in) :: self
    integer, intent(in) :: i

    share = merge(self%driving(i), self%driven(i), first_wheel_drives(self%mode(i)))
  end function share

  !> The equations of all moments with the present modes.
  pure subroutine equations(self, matrix, wanted)
    class(joint_problem_t), intent(in) :: self
    real(wp), intent(out) :: matrix(:, :)   !! [joints, joints]
    real(wp), intent(out) :: wanted(:)      !! [joints]
    integer :: i

    matrix = 0.0_wp
    wanted = 0.0_wp
    do i = 1, size(self%mode)
      if (self%mode(i) == locked) then
        matrix(i, :) = self%w(i, :)
        wanted(i) = -self%rate(i)
        if (self%w(i, i) > 0) then
          matrix(i, :) = matrix(i, :) / self%w(i, i)
          wanted(i) = wanted(i) / self%w(i, i)
        end if
        cycle
      end if
      matrix(i, i) = 1.0_wp
      if (self%has_teeth(i)) then
        matrix(i, :) = matrix(i, :) + self%share(i) * self%v(i, :)
        wanted(i) = -self%share(i) * self%load(i)
      else if (self%is_at_rest(i)) then
        wanted(i) = self%sliding(merge(1, 2, direction_of(self%mode(i)) > 0), i)
      end if
    end do
  end subroutine equations

  !> Equations in the unit of `roots`. Redundant locks have some flexibility here, by which they share their moment.
  pure subroutine scaled_equations(self, matrix, wanted)
    class(joint_problem_t), intent(in) :: self
    real(wp), intent(out) :: matrix(:, :)   !! [joints, joints]
    real(wp), intent(out) :: wanted(:)      !! [joints]
    real(wp) :: root(size(self%mode))
    integer :: i

    call self%equations(matrix, wanted)
    root = self%roots()
    wanted = root * wanted
    do i = 1, size(root)
      matrix(i, :) = root(i) * matrix(i, :) / root
      if (self%mode(i) == locked) matrix(i, i) = matrix(i, i) + flexibility
    end do
  end subroutine scaled_equations

  !> The moments with the present modes; the moments of joints that slip away are in the laws.
  subroutine find_moments(self)
    class(joint_problem_t), intent(inout) :: self
    real(wp), dimension(size(self%mode), size(self%mode)) :: factors, matrix
    real(wp) :: pivots(size(self%mode)), wanted(size(self%mode))
    integer :: i, order(size(self%mode))
    logical :: is_singular

    call self%equations(matrix, wanted)
    factors = matrix
    call lu_factor(factors, order, is_singular)
    pivots = [(abs(factors(i, i)), i=1, size(pivots))]
    if (is_singular .or. minval(pivots) <= null_tolerance * maxval(pivots)) then
      factors = pseudo_inverse(matrix, null_tolerance)
      self%moment(:) = matmul(factors, wanted)
    else
      self%moment(:) = wanted
      call lu_solve(factors, order, self%moment)
    end if
  end subroutine find_moments

  !> Whether the moments of the present modes are the limit of the moments of elastic teeth, whose deflection goes back to them:
  !> the determinant of the equations is positive. Where it is negative, 1 + s V of one pair of teeth, a deflection grows, away
  !> from these moments.
  logical function is_stable(self)
    class(joint_problem_t), intent(in) :: self
    real(wp) :: matrix(size(self%mode), size(self%mode)), wanted(size(self%mode))
    integer :: i, order(size(self%mode))
    logical :: is_singular

    call self%scaled_equations(matrix, wanted)
    call lu_factor(matrix, order, is_singular)
    is_stable = .true.
    do i = 1, size(order)
      if ((matrix(i, i) < 0) .neqv. (order(i) /= i)) is_stable = .not. is_stable
    end do
    is_stable = is_stable .or. is_singular
  end function is_stable

  !> The accelerations with the present moments, 0 where they are rounding errors [rad/s2].
  pure function accelerations(self)
    class(joint_problem_t), intent(in) :: self
    real(wp), dimension(size(self%mode)) :: accelerations, root, smallest
    integer :: i

    root = self%roots()
    smallest = [(abs(self%rate(i)) + sum(abs(self%w(i, :) * self%moment)), i=1, size(root))]
    smallest = merge(inconsistent, no_slip, self%mode == locked) * max(smallest, mixed * root * maxval(smallest / root))
    accelerations = self%rate + matmul(self%w, self%moment)
    where (abs(accelerations) <= smallest) accelerations = 0.0_wp
  end function accelerations

  !> Whether a locked joint or a row that moves is not held by the present moments, as others contradict it.
  pure logical function is_contradicted(self)
    class(joint_problem_t), intent(in) :: self

    is_contradicted = any(self%mode == locked .and. abs(self%accelerations()) > 0)
  end function is_contradicted

  !> The modes that the moments speak for. The acceleration of a locked joint is not zero where other rows contradict it.
  function better_modes(self) result(mode)
    class(joint_problem_t), intent(in) :: self
    integer :: mode(size(self%mode))
    real(wp), dimension(size(self%mode)) :: acceleration, error, load, root, smallest
    integer :: i
    logical :: holds_always(size(self%mode))

    mode = self%mode
    holds_always = self%holds_always()
    root = self%roots()
    error = 8.0_wp * epsilon(1.0_wp) * maxval(abs(self%moment) * root) / root   ! of the moments
    acceleration = self%accelerations()
    load = self%load + matmul(self%v, self%moment)
    smallest = [(abs(self%load(i)) + sum(abs(self%v(i, :) * self%moment)), i=1, size(mode))]
    smallest = rounding * max(smallest, mixed * maxval(smallest))
    smallest = smallest + [(sum(abs(self%v(i, :)) * error), i=1, size(mode))]
    where (abs(load) <= smallest) load = 0.0_wp
    error = min(error, self%most_beyond)
    do i = 1, size(mode)
      if (self%has_teeth(i)) then
        mode(i) = self%better_teeth(i, acceleration(i), load(i), error(i))
      else if (self%is_at_rest(i) .and. .not. holds_always(i)) then
        mode(i) = self%better_friction(i, acceleration(i), error(i))
      end if
    end do
  end function better_modes

  !> Joints at rest whose moments have no bounds: dog clutches, and rows that move.
  pure function holds_always(self)
    class(joint_problem_t), intent(in) :: self
    logical :: holds_always(size(self%mode))

    holds_always = self%is_at_rest .and. self%least <= -huge(1.0_wp) .and. self%most >= huge(1.0_wp)
  end function holds_always

  !> The mode of teeth. Where the torque T is along the motion, the second wheel drives the first one.
  integer function better_teeth(self, i, acceleration, load, error) result(mode)
    class(joint_problem_t), intent(in) :: self
    integer, intent(in) :: i
    real(wp), intent(in) :: acceleration   !! [rad/s2]
    real(wp), intent(in) :: load           !! T [N m]
    real(wp), intent(in) :: error          !! of its moment [N m]
    real(wp) :: direction, least, most, tolerance

    mode = self%mode(i)
    direction = direction_of(mode)
    if (mode == locked) then
      least = min(-self%driven(i) * load, -self%driving(i) * load)
      most = max(-self%driven(i) * load, -self%driving(i) * load)
      tolerance = 0.5_wp * rounding * abs(self%moment(i)) + error
      if (self%moment(i) < least - tolerance) direction = 1.0_wp
      if (self%moment(i) > most + tolerance) direction = -1.0_wp
      if (abs(acceleration) > 0) direction = sign(1.0_wp, acceleration)   ! a drive moves it, for instance
      if (abs(direction) <= 0) return
    else if (self%is_at_rest(i) .and. direction * acceleration < 0) then
      mode = locked
      return
    end if
    if (mode /= locked .and. abs(load) <= 0) return
    if (direction > 0) mode = merge(slips_forwards, driven_forwards, load > 0)
    if (direction < 0) mode = merge(slips_backwards, driven_backwards, load < 0)
  end function better_teeth

  !> The mode of friction between bounds, at rest. It does not slip where its moment has no bound.
  integer function better_friction(self, i, acceleration, error) result(mode)
    class(joint_problem_t), intent(in) :: self
    integer, intent(in) :: i
    real(wp), intent(in) :: acceleration   !! [rad/s2]
    real(wp), intent(in) :: error          !! of its moment [N m]

    mode = self%mode(i)
    if (mode == locked) then
      if (self%moment(i) < self%least(i) - error) mode = slips_forwards
      if (self%moment(i) > self%most(i) + error) mode = slips_backwards
      if (acceleration > 0 .and. self%least(i) > -huge(1.0_wp)) mode = slips_forwards
      if (acceleration < 0 .and. self%most(i) < huge(1.0_wp)) mode = slips_backwards
    else if (mode == slips_backwards .and. self%most(i) >= huge(1.0_wp)) then
      mode = locked
    else if (mode == slips_forwards .and. self%least(i) <= -huge(1.0_wp)) then
      mode = locked
    else if (direction_of(mode) * acceleration < 0) then
      mode = locked
      if (self%most(i) <= self%least(i)) mode = merge(slips_forwards, slips_backwards, acceleration > 0)
    end if
  end function better_friction

end module nocdyn_joint_problem
