!> Plain steps: what an integrator, a system and an observer share where a system takes whole steps by itself, by a program that
!> was compiled for it. They are the steps of the method `taylor` in which nothing has to be decided: the series is finite, its
!> step not too small, and no event, output time or sampled function lies in it. Where a switch does, they end there.
!>
!> The types are laid out as `steps` and `range` of base/code/steps.inc.
module nocdyn_plain_steps
  use, intrinsic :: iso_c_binding, only: c_double, c_funptr, c_int, c_long, c_null_funptr, c_null_ptr, c_ptr
  implicit none (type, external)
  private

  ! What has become of a lane.
  integer, parameter, public :: no_step = 0      !! something has to be decided for a lane nearby
  integer, parameter, public :: plain_step = 1   !! it has taken steps
  integer, parameter, public :: last_step = 2    !! it has taken a step to its end

  !> A function of the state, x = offset + sum of factor * y, whose range over time the steps widen.
  type, bind(c), public :: plain_range_t
    integer(c_int) :: number = 0                        !! for the observer
    integer(c_int) :: entries = 0                       !! even
    integer(c_int) :: has_range = 0, has_sums = 0       !! whether extremes, and integrals, are needed
    integer(c_int) :: has_time = 0, has_max_abs = 0     !! whether times of extremes, and the largest size, are needed
    type(c_ptr) :: component = c_null_ptr               !! of the state, integers [entries]
    type(c_ptr) :: factor = c_null_ptr                  !! [8, entries] of the first eight lanes
    type(c_ptr) :: offset = c_null_ptr                  !! [8]
    integer(c_long) :: factor_step = 0, offset_step = 0 !! numbers to the next eight lanes
    type(c_ptr) :: highest = c_null_ptr, lowest = c_null_ptr, highest_time = c_null_ptr, lowest_time = c_null_ptr   !! [lanes]
    type(c_ptr) :: no_highest = c_null_ptr, no_lowest = c_null_ptr   !! huge where an extreme is not needed, else -huge; [lanes]
    type(c_ptr) :: integral = c_null_ptr, square = c_null_ptr   !! of f(x) = (linear + cubic x^2) x and its square, [lanes]
    type(c_ptr) :: linear = c_null_ptr, cubic = c_null_ptr      !! [lanes]
  end type plain_range_t

  !> A lane that steps by series where kinds of steps can be chosen, and has nothing to decide: its steps are counted together.
  type, bind(c), public :: calm_lane_t
    integer(c_int) :: steps = 0         !! accepted steps without a decision, unless they show signs of stiffness
    integer(c_int) :: uncounted = 0     !! of these, those that have been made
    integer(c_int) :: signs = 0         !! consecutive signs that implicit steps may cost less
    integer(c_int) :: is_in_doubt = 0   !! whether there was a weak sign
    integer(c_int) :: waits = 0         !! whether signs lead to nothing yet
    integer(c_int) :: has_moved = 0     !! whether the last attempt was accepted
  end type calm_lane_t

  !> All lanes of a block.
  type, bind(c), public :: plain_steps_t
    integer(c_long) :: lanes = 0, columns = 0           !! columns of the state, with padding
    integer(c_long) :: measures = 0, phases = 0         !! measured quantities, and those before the phases, whose size is about 1
    integer(c_long) :: ranges = 0
    integer(c_long) :: most = 1                         !! steps of a lane at once
    integer(c_long) :: turning = 0                      !! states that are shifted where they have gone far
    real(c_double) :: rtol = 0.0_c_double, atol = 0.0_c_double
    real(c_double) :: t_end = 0.0_c_double, longest = 0.0_c_double   !! end, longest step [s]
    type(c_ptr) :: t = c_null_ptr, y = c_null_ptr       !! [lanes], [lanes, columns]
    type(c_ptr) :: size = c_null_ptr                    !! of the measured quantities, [lanes, measures]
    type(c_ptr) :: h = c_null_ptr                       !! steps that were taken [s], [lanes]
    type(c_ptr) :: running = c_null_ptr                 !! whether a lane has a variant, integers [lanes]
    type(c_ptr) :: outcome = c_null_ptr                 !! no_step and so on, [lanes]
    type(c_ptr) :: taken = c_null_ptr                   !! number of steps, integers [lanes]
    type(c_ptr) :: turn = c_null_ptr                    !! freedoms whose angles are shifted, [turning]
    type(c_ptr) :: far = c_null_ptr                     !! angles beyond which they are [rad], [lanes]
    type(c_ptr) :: first = c_null_ptr, column = c_null_ptr           !! of the map from the state to the measures
    type(c_ptr) :: coefficient = c_null_ptr, offset = c_null_ptr     !! [lanes, entries], [lanes, measures]
    type(c_ptr) :: wanted = c_null_ptr                  !! steps that the series allow [s], [lanes]
    type(c_ptr) :: calm = c_null_ptr                    !! calm_lane_t [lanes], or null: the steps are no choice
    real(c_double) :: near = 0.0_c_double, weak = 0.0_c_double   !! |h lambda|, a sign of stiffness, and a weak one
    type(c_ptr) :: range = c_null_ptr                   !! [ranges]
    type(c_ptr) :: chord_gap = c_null_ptr               !! largest s - s^p, s from 0 to 1, p = 1 to the order
    type(c_ptr) :: node = c_null_ptr, weight = c_null_ptr   !! of Gauss's rule with a point more than the order, -1 to 1
    type(c_ptr) :: observer = c_null_ptr                !! argument of `look`
    type(c_funptr) :: look = c_null_funptr              !! called where a range may be exceeded inside a step
    type(c_ptr) :: indicator = c_null_ptr               !! of the switches, where the lanes are, [lanes, switches]
    type(c_ptr) :: side = c_null_ptr                    !! their signs, integers [lanes, switches]
    type(c_ptr) :: crossed = c_null_ptr                 !! switch that has ended the last step of a lane, or 0; less than 0 after
                                                        !! `change_plain_branches`; integers [lanes]
    real(c_double) :: stretch = 0.0_c_double            !! a step is stretched so much to end on the end
    real(c_double) :: memory = 0.0_c_double             !! of the sizes of measured quantities
    real(c_double) :: rounding = 0.0_c_double           !! of large angles, relative to them
    real(c_double) :: largest_exponent = 0.0_c_double   !! of 2, in estimates of eigenvalues
    integer(c_long) :: stiff_signs = 0                  !! consecutive signs of stiffness that are decided about
    real(c_double) :: promising = 0.0_c_double, least_distance = 0.0_c_double   !! as in `find_grazing` of root functions ...
    integer(c_long) :: grazing_steps = 0                !! ... and how often it guesses
  end type plain_steps_t

end module nocdyn_plain_steps
