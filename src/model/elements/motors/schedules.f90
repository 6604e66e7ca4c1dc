!> Numbers of motors that follow the time: straight lines from point to point, with jumps where two points have one time.
!>
!> The stretches between the points are the branches of a switch, so that steps end at the points. A schedule of an element has as
!> many stretches as the longest one of its bank; those that it lacks begin after all times.
module nocdyn_schedules
  use nocdyn_bank, only: bank_t
  use nocdyn_described_elements, only: never, time_reached
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, operator(*), operator(+), operator(-), pick, time_of
  use nocdyn_law_functions, only: add_guard
  use nocdyn_law_tape, only: law_tape_t
  implicit none (type, external)
  private

  public :: join_points, add_schedule, scheduled_value, scheduled_flag, guard_schedule, value_at

  !> One schedule. The first stretch is that before the first point.
  type, public :: schedule_t
    real(wp), allocatable :: begin(:)   !! of each stretch, ascending; the one of the first one is of no use [s]
    real(wp), allocatable :: value(:)   !! at the begin of each stretch
    real(wp), allocatable :: slope(:)   !! [1/s]
    logical, allocatable :: flag(:)     !! what else holds on a stretch
  contains
    procedure :: append
    procedure :: at
  end type schedule_t

contains

  !> Adds a stretch after the others.
  subroutine append(self, begin, value, slope, flag)
    class(schedule_t), intent(inout) :: self
    real(wp), intent(in) :: begin, value, slope   !! as in the type
    logical, intent(in) :: flag
    real(wp) :: nothing(0)

    if (.not. allocated(self%begin)) then
      allocate (self%begin, self%value, self%slope, source=nothing)
      allocate (self%flag(0))
    end if
    self%begin = [self%begin, begin]
    self%value = [self%value, value]
    self%slope = [self%slope, slope]
    self%flag = [self%flag, flag]
  end subroutine append

  !> The number at a time.
  pure real(wp) function at(self, t)
    class(schedule_t), intent(in) :: self
    real(wp), intent(in) :: t   !! [s]
    integer :: s

    do s = size(self%begin), 2, -1
      if (time_reached(t) >= self%begin(s)) exit
    end do
    s = max(s, 1)
    at = self%value(s) + self%slope(s) * (t - self%begin(s))
  end function at

  !> The schedule through points, with the first value before them and the last one after them.
  subroutine join_points(time, value, schedule)
    real(wp), intent(in) :: time(:)    !! ascending, [points] [s]
    real(wp), intent(in) :: value(:)   !! [points]
    type(schedule_t), intent(out) :: schedule
    integer :: i

    call schedule%append(time(1), value(1), 0.0_wp, .false.)
    do i = 1, size(time) - 1
      call schedule%append(time(i), value(i), (value(i + 1) - value(i)) / (time(i + 1) - time(i)), .false.)
    end do
    call schedule%append(time(size(time)), value(size(time)), 0.0_wp, .false.)
  end subroutine join_points

  !> Gives every element a schedule, and a switch between its stretches.
  subroutine add_schedule(bank, name, schedule, boundary)
    class(bank_t), intent(inout) :: bank
    character(len=*), intent(in) :: name       !! of the scheduled number, at most 16 characters
    type(schedule_t), intent(in) :: schedule(:, :)   !! [lanes, elements]
    character(len=*), intent(in) :: boundary   !! name of the end of a stretch
    integer :: e, lane, n, stretches
    real(wp), allocatable, dimension(:, :, :) :: begin, flag, slope, value

    stretches = maxval([0, (size(schedule(1, e)%begin), e=1, bank%count)])
    allocate (begin(bank%lanes, bank%count, stretches), source=never)
    allocate (flag, slope, value, source=0.0_wp * begin)
    do e = 1, bank%count
      do lane = 1, bank%lanes
        associate (one => schedule(lane, e))
          n = size(one%begin)
          begin(lane, e, :n) = one%begin
          value(lane, e, :n) = one%value
          slope(lane, e, :n) = one%slope
          flag(lane, e, :n) = merge(1.0_wp, 0.0_wp, one%flag)
        end associate
      end do
    end do
    call bank%add_parts(name, value)
    call bank%add_parts(name // ' time', begin)
    call bank%add_parts(name // ' slope', slope)
    call bank%add_parts(name // ' flag', flag)
    call bank%add_switches(spread(boundary, 1, bank%count), stretches)
  end subroutine add_schedule

  !> Number of stretches of the schedules of a bank.
  pure integer function stretches_of(bank, name) result(stretches)
    class(bank_t), intent(in) :: bank
    character(len=*), intent(in) :: name

    stretches = size(bank%parameters(bank%number_of(name))%element) / bank%count
  end function stretches_of

  !> A number of the present stretch.
  function picked(bank, tape, name, switch) result(number)
    class(bank_t), intent(in) :: bank
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name   !! of a parameter
    integer, intent(in) :: switch
    type(expression_t) :: number
    integer :: s

    number = pick(switch, [(bank%parameter(tape, name, bank%part_columns(s)), s=1, stretches_of(bank, name))])
  end function picked

  !> The scheduled number.
  function scheduled_value(bank, tape, name, switch) result(value)
    class(bank_t), intent(in) :: bank
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    integer, intent(in) :: switch   !! of the schedule, numbered within an element
    type(expression_t) :: value

    value = picked(bank, tape, name, switch) + picked(bank, tape, name // ' slope', switch) &
            * (time_of(tape) - picked(bank, tape, name // ' time', switch))
  end function scheduled_value

  !> 1 if the flag of the present stretch is set, else 0.
  function scheduled_flag(bank, tape, name, switch) result(flag)
    class(bank_t), intent(in) :: bank
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    integer, intent(in) :: switch   !! of the schedule, numbered within an element
    type(expression_t) :: flag

    flag = picked(bank, tape, name // ' flag', switch)
  end function scheduled_flag

  !> The begin of the next stretch is the boundary of a branch; the time does not go back.
  subroutine guard_schedule(bank, tape, name, switch)
    class(bank_t), intent(in) :: bank
    type(law_tape_t), target, intent(inout) :: tape
    character(len=*), intent(in) :: name
    integer, intent(in) :: switch   !! of the schedule, numbered within an element
    integer :: s

    do s = 1, stretches_of(bank, name) - 1
      call add_guard(switch, s, bank%parameter(tape, name // ' time', bank%part_columns(s + 1)) - time_of(tape), &
                     literal(tape, 0.0_wp))
    end do
  end subroutine guard_schedule

  !> Number of the stretch of an element in the first lane at a time.
  pure integer function stretch_at(bank, name, element, t) result(stretch)
    class(bank_t), intent(in) :: bank
    character(len=*), intent(in) :: name
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]

    associate (begin => bank%parameters(bank%number_of(name // ' time'))%value(1, element::bank%count))
      do stretch = size(begin), 2, -1
        if (time_reached(t) >= begin(stretch)) return
      end do
    end associate
    stretch = 1
  end function stretch_at

  !> The scheduled number of an element in the first lane at a time.
  pure real(wp) function value_at(bank, name, element, t) result(value)
    class(bank_t), intent(in) :: bank
    character(len=*), intent(in) :: name
    integer, intent(in) :: element   !! numbered within the bank
    real(wp), intent(in) :: t        !! [s]
    integer :: column

    column = element + (stretch_at(bank, name, element, t) - 1) * bank%count
    associate (parameters => bank%parameters)
      value = parameters(bank%number_of(name))%value(1, column) + parameters(bank%number_of(name // ' slope'))%value(1, column) &
              * (t - parameters(bank%number_of(name // ' time'))%value(1, column))
    end associate
  end function value_at

end module nocdyn_schedules
