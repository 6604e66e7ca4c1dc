!> The numbers of a machine by which its answers are differentiated: all that an input gives, one by one.
!>
!> What is differentiated is evaluated for the machines of the input with numbers p + k h beside p, and everything else, motions
!> and eigenvectors, stays as it is. The numbers of a linear machine are smooth functions of those of the input, mostly powers:
!> where the steady state stays too, nothing is iterated, and two points have nine digits (h = 4e-6 p). Where it is found anew,
!> differences of the sixth order over k = -3 ... 3 keep its tolerance small (h = 2e-3 p). Along a run, four points over k = -2
!> ... 2 keep rounding below the tolerance of its steps (h = 1e-3 p). Where a key does not allow p + k h on one side, the points
!> are on the other one.
module nocdyn_varied_keys
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_lu, only: lu_factor, lu_solve
  use nocdyn_schema, only: first_key, group_rules, key_rules
  use nocdyn_schema_rules, only: a_number, in_machine, in_torques, key_rule_t
  use nocdyn_targets, only: find_target, set_targets, target_t
  use nocdyn_text, only: append, counted, joined, string_t, to_text
  use nocdyn_units, only: in_si, unit_deg
  implicit none (type, external)
  private

  public :: find_weights, list_varied_keys, set_key

  integer, parameter, public :: points = 6                   !! of a difference with steady states that are found anew
  integer, parameter, public :: near_points = 2              !! of one with states that stay
  integer, parameter, public :: run_points = 4               !! of one along a run
  integer, parameter :: most_of_a_list = 12                  ! numbers of a list that are looked at one by one
  real(wp), parameter :: relative_step = 2.0e-3_wp           ! h, as a share of the number; of angles at least [rad]
  real(wp), parameter :: near_step = 4.0e-6_wp               ! the same of near points; of angles [rad]
  real(wp), parameter :: run_step = 1.0e-3_wp                ! and of those along a run
  integer, parameter, public :: central(points) = [-3, -2, -1, 1, 2, 3]
  integer, parameter :: one_sided(points) = [1, 2, 3, 4, 5, 6]

  !> One number.
  type, public :: varied_key_t
    type(target_t) :: target
    real(wp) :: value = 0.0_wp              !! in SI
    real(wp) :: small = 0.0_wp              !! one per cent of it, or one degree of an angle
    character(len=5) :: small_text = '1 %'
    real(wp) :: change(points) = 0.0_wp     !! of the number at each point
    real(wp) :: weight(points) = 0.0_wp     !! of the derivative at its value
    real(wp) :: weight_here = 0.0_wp        !! of the value itself; 0 where the points are on both sides
    real(wp) :: near(near_points) = 0.0_wp           !! the same for near points
    real(wp) :: near_weight(near_points) = 0.0_wp
    real(wp) :: near_weight_here = 0.0_wp
    real(wp) :: run(run_points) = 0.0_wp             !! the same for those along a run
    real(wp) :: run_weight(run_points) = 0.0_wp
    real(wp) :: run_weight_here = 0.0_wp
  end type varied_key_t

contains

  !> The numbers that the bodies, connections and torques of an input have. Those that are 0, whole numbers, and long lists are
  !> left out; notes say so.
  subroutine list_varied_keys(given, keys, notes)
    type(input_t), intent(in) :: given
    type(varied_key_t), allocatable, intent(out) :: keys(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(string_t), allocatable :: fixed(:), long(:)
    type(varied_key_t) :: key
    type(input_t) :: input
    character(len=:), allocatable :: path
    integer :: count, g, i, k
    logical :: is_possible

    input = given
    allocate (keys(64), long(0), fixed(0))
    count = 0
    do g = 1, size(input%groups)
      associate (group => input%groups(g))
        if (all(group_rules(group%rule)%topic /= [in_machine, in_torques]) .or. group%name == '') cycle
        do k = 1, size(group%values)
          associate (rule => key_rules(first_key(group%rule) + k - 1), value => group%values(k))
            if (rule%value_type /= a_number .or. .not. value%is_given .or. .not. allocated(value%numbers)) cycle
            if (index(rule%name, 'order') > 0 .or. rule%name == 'harmonics_up_to') cycle   ! which lines there are
            path = group%kind // '.' // group%name // '.' // trim(rule%name)
            if (size(value%numbers) > most_of_a_list .or. rule%ascends) then
              call append(long, path)
              cycle
            end if
            do i = 1, size(value%numbers)
              if (.not. abs(value%numbers(i)) > 0) cycle
              call find_key(input, path, i, size(value%numbers), rule, key, is_possible)
              if (is_possible) then
                call append_key(keys, count, key)
              else
                call append(fixed, path)
              end if
            end do
          end associate
        end do
      end associate
    end do
    keys = keys(:count)
    if (size(long) > 0) call append(notes, 'without the numbers of tables: ' // joined(long, ', ', 4))
    if (size(fixed) > 0) call append(notes, 'without numbers that other keys leave no room: ' // joined(fixed, ', ', 4))
  end subroutine list_varied_keys

  subroutine append_key(keys, count, key)
    type(varied_key_t), allocatable, intent(inout) :: keys(:)   !! the first `count` are in use
    integer, intent(inout) :: count
    type(varied_key_t), intent(in) :: key
    type(varied_key_t), allocatable :: more(:)

    if (count == size(keys)) then
      allocate (more(2 * count))
      more(:count) = keys
      call move_alloc(more, keys)
    end if
    count = count + 1
    keys(count) = key
  end subroutine append_key

  !> A number with the points at which it is looked at.
  subroutine find_key(input, path, position, count, rule, key, is_possible)
    type(input_t), intent(inout) :: input
    character(len=*), intent(in) :: path        !! without a subscript
    integer, intent(in) :: position, count      !! in the list of the key
    type(key_rule_t), intent(in) :: rule
    type(varied_key_t), intent(out) :: key
    logical, intent(out) :: is_possible         !! whether it can be changed alone
    integer :: side
    real(wp) :: step
    character(len=:), allocatable :: message, whole

    whole = path
    if (count > 1) whole = path // '(' // to_text(position) // ')'
    call find_target(input, whole, key%target, message)
    is_possible = message == ''
    if (.not. is_possible) return
    key%value = input%groups(key%target%group)%values(key%target%key)%numbers(position)
    step = relative_step * abs(key%value)
    key%small = 0.01_wp * key%value
    key%small_text = '1 %'
    if (rule%unit == 'rad') then
      step = max(step, relative_step)
      key%small = in_si(1.0_wp, unit_deg)
      key%small_text = '1 deg'
    end if
    do side = 0, 2   ! both, below, above
      select case (side)
      case (0)
        key%change = step * central
      case (1)
        key%change = -sign(step, key%value) * one_sided
      case default
        key%change = sign(step, key%value) * one_sided
      end select
      call try_change(input, key, maxval(key%change), is_possible)
      if (is_possible) call try_change(input, key, minval(key%change), is_possible)
      if (is_possible) exit
    end do
    if (.not. is_possible) return
    call find_weights(key%change, key%weight, key%weight_here)
    step = abs(key%value)
    if (rule%unit == 'rad') step = 1.0_wp
    key%near = near_step * step * [-1, 1]
    key%run = run_step * step * [-2, -1, 1, 2]
    if (side > 0) then
      step = sign(step, key%change(1))
      key%near = near_step * step * one_sided(:near_points)
      key%run = run_step * step * one_sided(:run_points)
    end if
    call find_weights(key%near, key%near_weight, key%near_weight_here)
    call find_weights(key%run, key%run_weight, key%run_weight_here)
  end subroutine find_key

  !> Whether a key may have a changed number.
  subroutine try_change(input, key, change, is_allowed)
    type(input_t), intent(inout) :: input   !! has the number itself again after all
    type(varied_key_t), intent(in) :: key
    real(wp), intent(in) :: change
    logical, intent(out) :: is_allowed
    character(len=:), allocatable :: again, message

    call set_targets(input, [key%target], [key%value + change], message)
    is_allowed = message == ''
    call set_targets(input, [key%target], [key%value], again)
  end subroutine try_change

  !> The weights of points, and of the point between or beside them, with which polynomials of a degree that is their number are
  !> differentiated exactly.
  subroutine find_weights(change, weight, weight_here)
    real(wp), intent(in) :: change(:)    !! at which the function is evaluated, none of them 0
    real(wp), intent(out) :: weight(:), weight_here
    real(wp) :: powers(size(change), size(change)), scale, solution(size(change))
    integer :: k, pivots(size(change))
    logical :: is_singular

    scale = maxval(abs(change))
    do k = 1, size(change)
      powers(k, :) = (change / scale)**k
    end do
    solution = 0.0_wp
    solution(1) = 1.0_wp / scale
    call lu_factor(powers, pivots, is_singular)
    call lu_solve(powers, pivots, solution)
    weight = solution
    weight_here = -sum(weight)
    if (abs(sum(change)) <= epsilon(scale) * scale) weight_here = 0.0_wp
  end subroutine find_weights

  !> Changes a number of an input.
  subroutine set_key(input, key, change)
    type(input_t), intent(inout) :: input
    type(varied_key_t), intent(in) :: key
    real(wp), intent(in) :: change   !! of the number
    character(len=:), allocatable :: message

    call set_targets(input, [key%target], [key%value + change], message)
  end subroutine set_key

end module nocdyn_varied_keys
