!> Which joints lock where teeth with losses are among them, whose bounds grow with the torque that they transmit.
!>
!> The modes that agree with their moments (`nocdyn_joint_problem`) are sought as in a complementarity problem: from the present
!> ones, first all wrong ones change together, then one at a time, the one of least index (K. G. Murty, Linear Complementarity,
!> Linear and Nonlinear Programming, 1988, chapter 4); else from each combination of modes of teeth, or the first ones of many,
!> with the modes of friction by pivoting (`nocdyn_joint_pivots`). Of several solutions those count that are limits of the motion
!> of elastic teeth. Where none is left, turning teeth jam.
module nocdyn_joint_choices
  use nocdyn_friction_joints, only: direction_of, driven_backwards, driven_forwards, locked, slips_backwards, slips_forwards
  use nocdyn_joint_pivots, only: pivot_modes
  use nocdyn_joint_problem, only: inconsistent, joint_problem_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
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
    procedure, private :: take_combination
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

  !> Seeks the modes from all combinations of the modes of teeth.
  subroutine combine(self, is_found)
    class(joint_choices_t), intent(inout) :: self
    logical, intent(out) :: is_found
    integer :: number
    logical :: is_left

    is_found = .false.
    number = 0
    call self%take_combination(number, is_left)
    do while (is_left)
      call self%pivot(is_found)
      if (is_found) return
      number = number + 1
      call self%take_combination(number, is_left)
    end do
  end subroutine combine

  !> Gives teeth the modes of a combination.
  pure subroutine take_combination(self, number, is_left)
    class(joint_choices_t), intent(inout) :: self
    integer, intent(in) :: number      !! from 0 on
    logical, intent(out) :: is_left    !! whether there is this one; of many the first ones are enough
    integer, parameter :: at_rest(*) = [locked, slips_forwards, slips_backwards, driven_forwards, driven_backwards]
    integer, parameter :: forwards(*) = [slips_forwards, driven_forwards], backwards(*) = [slips_backwards, driven_backwards]
    integer, parameter :: most_tried = 3125
    integer :: i, rest

    rest = number
    do i = 1, size(self%mode)
      if (.not. self%has_teeth(i)) cycle
      if (self%is_at_rest(i)) then
        self%mode(i) = at_rest(1 + modulo(rest, 5))
        rest = rest / 5
      else
        self%mode(i) = merge(forwards(1 + modulo(rest, 2)), backwards(1 + modulo(rest, 2)), self%slip(i) > 0)
        rest = rest / 2
      end if
    end do
    is_left = rest == 0 .and. number < most_tried
  end subroutine take_combination

  !> Seeks modes by pivoting, from the present modes of teeth. Where friction that slips is less than at rest, the others are
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

  !> Finds turning teeth whose second wheel brakes the first one more than its inertia allows: their 1 + s V is not positive, with
  !> what other joints do to T. First, all at rest are locked, then those only that hold always.
  subroutine find_jam(self)
    class(joint_choices_t), intent(inout) :: self
    real(wp) :: matrix(size(self%mode), size(self%mode)), moment(size(self%mode)), steepest
    integer :: i, mode(size(self%mode)), number, order(size(self%mode)), trial
    logical :: is_left, is_singular

    mode = self%mode
    do trial = 1, 2
      steepest = -huge(1.0_wp)
      number = 0
      call self%take_combination(number, is_left)
      do while (is_left)
        where (self%is_at_rest .and. .not. self%has_teeth) self%mode = merge(locked, slips_forwards, self%holds_always() .or. &
                                                                             trial == 1 .and. self%least < self%most)
        call self%scaled_equations(matrix, moment)
        call lu_factor(matrix, order, is_singular)
        do i = 1, merge(0, size(mode), is_singular)
          if (.not. self%has_teeth(i) .or. self%is_at_rest(i)) cycle
          moment = 0.0_wp
          moment(i) = 1.0_wp
          call lu_solve(matrix, order, moment)   ! 1 / (1 + s V)
          if (moment(i) >= 0 .or. moment(i) <= steepest) cycle
          steepest = moment(i)
          self%jammed = i
        end do
        number = number + 1
        call self%take_combination(number, is_left)
      end do
      if (self%jammed > 0) exit
    end do
    self%mode(:) = mode
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
