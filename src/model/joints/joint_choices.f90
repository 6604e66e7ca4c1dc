!> Which joints lock where teeth with losses are among them, whose bounds grow with the torque that they transmit.
!>
!> The modes that agree with their moments (`nocdyn_joint_problem`) are sought as in a complementarity problem: from the present
!> ones, first all wrong ones change together, then one at a time, that of least index (K. G. Murty, Linear Complementarity,
!> Linear and Nonlinear Programming, 1988, chapter 4); else from each combination of modes of teeth, or the first ones of many,
!> with those of friction by pivoting (`nocdyn_joint_pivots`). Of several solutions those count that are limits of the motion of
!> elastic teeth. Where none is left, turning teeth jam.
module nocdyn_joint_choices
  use nocdyn_friction_joints, only: direction_of, driven_backwards, driven_forwards, locked, slips_backwards, slips_forwards
  use nocdyn_joint_pivots, only: pivot_modes
  use nocdyn_joint_problem, only: inconsistent, joint_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_semidefinite, only: null_tolerance
  implicit none (type, external)
  private

  type, extends(joint_problem_t), public :: joint_choices_t
    integer :: doubtful = 0   !! a joint without a mode that agrees, 0: none
    integer :: jammed = 0     !! teeth that turn and brake more than the inertias allow, so that they stop at once; 0: none
  contains
    procedure :: choose
    procedure, private :: settle
    procedure, private :: combine
    procedure, private :: pivot
    procedure, private :: find_jam
    procedure, private :: is_against_rows
  end type joint_choices_t

contains

  !> Chooses the modes; `mode` has some to begin with.
  subroutine choose(self)
    class(joint_choices_t), intent(inout) :: self
    integer :: mode(size(self%mode))
    logical :: is_found

    self%doubtful = 0
    self%jammed = 0
    where (self%is_at_rest) self%mode = locked
    mode = self%mode
    call self%settle(10 + 10 * size(mode), is_found)
    if (is_found) return
    call self%combine(is_found)
    if (is_found) return
    self%mode(:) = mode
    call self%find_moments()
    self%doubtful = findloc(self%is_against_rows(), .true., dim=1)
    if (self%doubtful > 0) then
      where (self%has_teeth .and. self%is_at_rest) self%mode = slips_forwards   ! friction contradicts nothing
      return
    end if
    call self%find_jam()
    if (self%jammed == 0) self%doubtful = max(1, findloc(self%has_teeth, .true., dim=1))
  end subroutine choose

  !> Changes modes that do not agree with their moments until all do.
  subroutine settle(self, most_changes, is_found)
    class(joint_choices_t), intent(inout) :: self
    integer, intent(in) :: most_changes
    logical, intent(out) :: is_found
    integer, parameter :: together = 10
    integer :: better(size(self%mode)), change, first

    is_found = .false.
    do change = 1, most_changes
      call self%find_moments()
      better = self%better_modes()
      if (all(better == self%mode)) then
        is_found = self%is_stable() .and. .not. self%is_contradicted()
        return
      end if
      first = findloc(better /= self%mode, .true., dim=1)
      if (change > together) then
        self%mode(first) = better(first)
      else
        self%mode(:) = better
      end if
    end do
  end subroutine settle

  !> Seeks the modes from all combinations of those of teeth, or from the first ones where they are many.
  subroutine combine(self, is_found)
    class(joint_choices_t), intent(inout) :: self
    logical, intent(out) :: is_found
    integer, parameter :: at_rest(*) = [locked, slips_forwards, slips_backwards, driven_forwards, driven_backwards]
    integer, parameter :: most_tried = 3125
    integer :: choices(size(self%mode)), i, number, rest

    choices = 1
    where (self%has_teeth) choices = merge(size(at_rest), 2, self%is_at_rest)
    is_found = .false.
    do number = 0, nint(min(real(most_tried, wp), product(real(choices, wp)))) - 1
      rest = number
      do i = 1, size(choices)
        if (.not. self%has_teeth(i)) cycle
        if (self%is_at_rest(i)) then
          self%mode(i) = at_rest(1 + modulo(rest, choices(i)))
        else if (self%slip(i) > 0) then
          self%mode(i) = merge(slips_forwards, driven_forwards, modulo(rest, 2) == 0)
        else
          self%mode(i) = merge(slips_backwards, driven_backwards, modulo(rest, 2) == 0)
        end if
        rest = rest / choices(i)
      end do
      call self%pivot(is_found)
      if (is_found) return
    end do
  end subroutine combine

  !> Seeks modes by pivoting, with those of teeth to begin with. Where friction that slips is less than at rest, the others are
  !> looked at again with it.
  subroutine pivot(self, is_found)
    class(joint_choices_t), intent(inout) :: self
    logical, intent(out) :: is_found
    integer, parameter :: most_changes = 10
    integer :: i
    real(wp), dimension(size(self%mode)) :: least, most, slipping
    logical :: has_changed

    least = self%least
    most = self%most
    has_changed = .true.
    do while (has_changed)
      call pivot_modes(self, is_found)
      if (.not. is_found) exit
      slipping = [(self%sliding(merge(1, 2, direction_of(self%mode(i)) > 0), i), i=1, size(slipping))]
      associate (has_left => self%is_at_rest .and. .not. self%has_teeth .and. self%mode /= locked .and. self%least < self%most)
        has_changed = any(has_left .and. (abs(slipping - least) > 0 .and. direction_of(self%mode) > 0 &
                                          .or. abs(slipping - most) > 0 .and. direction_of(self%mode) < 0))
        where (has_left .and. has_changed)
          self%least = slipping
          self%most = slipping
        end where
      end associate
    end do
    self%least(:) = least
    self%most(:) = most
    if (is_found) call self%settle(most_changes, is_found)
  end subroutine pivot

  !> Finds turning teeth whose second wheel brakes the first one more than its inertia allows where all joints at rest are locked:
  !> their 1 + s V is not positive, with what these joints do to T.
  subroutine find_jam(self)
    class(joint_choices_t), intent(inout) :: self
    integer, allocatable :: rows(:)
    integer :: i
    real(wp) :: least_slope, slope

    rows = pack([(i, i=1, size(self%mode))], self%is_at_rest .and. .not. self%has_teeth .and. self%least < self%most)
    least_slope = 0.0_wp
    associate (inverse => pseudo_inverse(self%w(rows, rows), null_tolerance))
      do i = 1, size(self%mode)
        if (.not. self%has_teeth(i) .or. self%is_at_rest(i)) cycle
        slope = 1 + self%driven(i) * (self%v(i, i) - dot_product(self%v(i, rows), matmul(inverse, self%w(rows, i))))
        if (slope > least_slope) cycle
        least_slope = slope
        self%jammed = i
      end do
    end associate
  end subroutine find_jam

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
