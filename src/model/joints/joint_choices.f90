!> Which joints lock where teeth with losses are among them, whose bounds grow with the torque that they transmit.
!>
!> With the modes of all joints chosen, their moments x follow from linear equations: no acceleration where a joint is locked, the
!> moment of slip where one slips, and x = -s (T + V x) where teeth turn. The modes are right if each moment, acceleration and
!> torque T agrees with its mode. They are sought as in a complementarity problem: first all wrong ones change together, then one
!> at a time, that of least index (K. G. Murty, Linear Complementarity, Linear and Nonlinear Programming, 1988, chapter 4), and
!> at last all combinations are tried where there are few.
module nocdyn_joint_choices
  use nocdyn_friction_joints, only: direction_of, driven_backwards, driven_forwards, first_wheel_drives, locked, &
    slips_backwards, slips_forwards
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_semidefinite, only: null_tolerance
  use nocdyn_tooth_loads, only: mixed
  implicit none (type, external)
  private

  type, public :: joint_choices_t
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
    integer, allocatable :: mode(:)            !! as chosen
    real(wp), allocatable :: moment(:)         !! x [N m]
    integer :: doubtful = 0                    !! a joint without a mode that agrees, 0: none
  contains
    procedure :: choose
    procedure, private :: find_moments
    procedure, private :: better_modes
    procedure, private :: better_teeth
    procedure, private :: better_friction
    procedure, private :: holds_always
    procedure, private :: try_all
    procedure, private :: is_against_rows
  end type joint_choices_t

  real(wp), parameter :: rounding = 1.0e-12_wp      ! of a torque, relative to its terms
  real(wp), parameter :: no_slip = 1.0e-10_wp       ! acceleration of a joint at its bound that others hold, likewise
  real(wp), parameter :: inconsistent = 1.0e-7_wp   ! acceleration of a lock that others do not allow, likewise
  integer, parameter :: most_tried = 4000

contains

  !> Chooses the modes; `mode` has some to begin with.
  subroutine choose(self)
    class(joint_choices_t), intent(inout) :: self
    integer, parameter :: together = 10
    integer :: better(size(self%mode)), change, first

    self%doubtful = 0
    where (self%is_at_rest) self%mode = locked
    do change = 1, together + 40 * size(self%mode)
      call self%find_moments()
      better = self%better_modes()
      if (all(better == self%mode)) return
      first = findloc(better /= self%mode, .true., dim=1)
      if (change > together) then
        self%mode(first) = better(first)
      else
        self%mode(:) = better
      end if
    end do
    call self%try_all()
  end subroutine choose

  !> The moments with the present modes; those of joints that slip away are in the laws.
  subroutine find_moments(self)
    class(joint_choices_t), intent(inout) :: self
    real(wp), dimension(size(self%mode), size(self%mode)) :: inverse, matrix
    real(wp) :: wanted(size(self%mode))
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
        associate (share => merge(self%driving(i), self%driven(i), first_wheel_drives(self%mode(i))))
          matrix(i, :) = matrix(i, :) + share * self%v(i, :)
          wanted(i) = -share * self%load(i)
        end associate
      else if (self%is_at_rest(i)) then
        wanted(i) = self%sliding(merge(1, 2, direction_of(self%mode(i)) > 0), i)
      end if
    end do
    inverse = pseudo_inverse(matrix, null_tolerance)
    self%moment(:) = matmul(inverse, wanted)
  end subroutine find_moments

  !> The modes that the moments speak for. The acceleration of a locked joint is not zero where other rows contradict it. What is
  !> below the rounding errors of all equations together counts as zero.
  function better_modes(self) result(mode)
    class(joint_choices_t), intent(in) :: self
    integer :: mode(size(self%mode))
    real(wp), dimension(size(self%mode)) :: acceleration, load, smallest
    integer :: i
    logical :: holds_always(size(self%mode))

    mode = self%mode
    holds_always = self%holds_always()
    acceleration = self%rate + matmul(self%w, self%moment)
    smallest = [(abs(self%rate(i)) + sum(abs(self%w(i, :) * self%moment)), i=1, size(mode))]
    smallest = merge(inconsistent, no_slip, mode == locked) * max(smallest, mixed * maxval(smallest))
    where (abs(acceleration) <= smallest) acceleration = 0.0_wp
    load = self%load + matmul(self%v, self%moment)
    smallest = [(abs(self%load(i)) + sum(abs(self%v(i, :) * self%moment)), i=1, size(mode))]
    smallest = rounding * max(smallest, mixed * maxval(smallest))
    where (abs(load) <= smallest) load = 0.0_wp
    do i = 1, size(mode)
      if (self%has_teeth(i)) then
        mode(i) = self%better_teeth(i, acceleration(i), load(i))
      else if (self%is_at_rest(i) .and. .not. holds_always(i)) then
        mode(i) = self%better_friction(i, acceleration(i))
      end if
    end do
  end function better_modes

  !> Joints at rest whose moments have no bounds: dog clutches, and rows that move.
  pure function holds_always(self)
    class(joint_choices_t), intent(in) :: self
    logical :: holds_always(size(self%mode))

    holds_always = self%is_at_rest .and. self%least <= -huge(1.0_wp) .and. self%most >= huge(1.0_wp)
  end function holds_always

  !> The mode of teeth. A torque T along the motion is that of a first wheel which the second one drives.
  integer function better_teeth(self, i, acceleration, load) result(mode)
    class(joint_choices_t), intent(in) :: self
    integer, intent(in) :: i
    real(wp), intent(in) :: acceleration   !! [rad/s2]
    real(wp), intent(in) :: load           !! T [N m]
    real(wp) :: direction, least, most, tolerance

    mode = self%mode(i)
    direction = direction_of(mode)
    if (mode == locked) then
      least = min(-self%driven(i) * load, -self%driving(i) * load)
      most = max(-self%driven(i) * load, -self%driving(i) * load)
      tolerance = 0.5_wp * rounding * abs(self%moment(i))
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
  integer function better_friction(self, i, acceleration) result(mode)
    class(joint_choices_t), intent(in) :: self
    integer, intent(in) :: i
    real(wp), intent(in) :: acceleration   !! [rad/s2]

    mode = self%mode(i)
    if (mode == locked) then
      if (self%moment(i) < self%least(i)) mode = slips_forwards
      if (self%moment(i) > self%most(i)) mode = slips_backwards
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

  !> Tries all combinations of modes.
  subroutine try_all(self)
    class(joint_choices_t), intent(inout) :: self
    integer, parameter :: at_rest(*) = [locked, slips_forwards, slips_backwards, driven_forwards, driven_backwards]
    integer :: better(size(self%mode)), i, number, rest
    integer :: choices(size(self%mode))

    choices = 1
    where (self%has_teeth) choices = 2
    where (self%is_at_rest) choices = 3
    where (self%is_at_rest .and. self%has_teeth) choices = 5
    where (self%holds_always()) choices = 1   ! that of a lock
    better = 0
    number = 0
    do while (number < min(real(most_tried, wp), product(real(choices, wp))))
      rest = number
      do i = 1, size(choices)
        if (self%is_at_rest(i)) then
          self%mode(i) = at_rest(1 + modulo(rest, choices(i)))
        else if (self%has_teeth(i) .and. self%slip(i) > 0) then
          self%mode(i) = merge(slips_forwards, driven_forwards, modulo(rest, 2) == 0)
        else if (self%has_teeth(i)) then
          self%mode(i) = merge(slips_backwards, driven_backwards, modulo(rest, 2) == 0)
        end if
        rest = rest / choices(i)
      end do
      call self%find_moments()
      better = self%better_modes()
      if (all(better == self%mode)) return
      number = number + 1
    end do
    self%doubtful = findloc(self%is_against_rows(), .true., dim=1)
    if (self%doubtful == 0) self%doubtful = max(1, findloc(self%has_teeth, .true., dim=1))
  end subroutine try_all

  !> Joints at rest that rows without bounds, such as drives, move in the direction in which they hold without a bound.
  function is_against_rows(self)
    class(joint_choices_t), intent(in) :: self
    logical :: is_against_rows(size(self%mode))
    integer, allocatable :: rows(:)
    integer :: i
    real(wp) :: acceleration, left   ! what is left of the response to its own moment
    real(wp), allocatable :: share(:)

    is_against_rows = .false.
    rows = pack([(i, i=1, size(self%mode))], self%holds_always())
    associate (inverse => pseudo_inverse(self%w(rows, rows), null_tolerance))
      do i = 1, size(self%mode)
        if (self%has_teeth(i) .or. .not. self%is_at_rest(i) .or. any(rows == i)) cycle
        share = matmul(inverse, self%w(rows, i))
        left = self%w(i, i) - dot_product(self%w(i, rows), share)
        acceleration = self%rate(i) - dot_product(share, self%rate(rows))
        if (left > inconsistent * self%w(i, i) .or. abs(acceleration) <= inconsistent * abs(self%rate(i))) cycle
        is_against_rows(i) = merge(self%least(i) <= -huge(1.0_wp), self%most(i) >= huge(1.0_wp), acceleration > 0)
      end do
    end associate
  end function is_against_rows

end module nocdyn_joint_choices
