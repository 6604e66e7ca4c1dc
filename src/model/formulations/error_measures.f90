!> The quantities in which the error of a step is measured: what breaks shafts, not the angles and speeds of bodies.
!>
!> They are linear functions of the states: the rates of twist of the couplings, the speeds of the rigid motions, the twists, the
!> other states, and the angles of the rigid motions. The size of a twist is its distance from the rest angle, the size of a
!> rigid motion's speed its distance from the speed at the start, and the size of its angle 1 rad, since a torque that depends on
!> an angle depends on its phase. So a rotation that is added to the whole machine changes no size and no error.
module nocdyn_error_measures
  use, intrinsic :: iso_c_binding, only: c_loc
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_sparse_map, only: new_sparse_map, sparse_map_t
  implicit none (type, external)
  private

  public :: new_error_measures

  type, public :: error_measures_t
    integer :: count = 0                   !! number of measured quantities
    integer, allocatable :: coupling(:)    !! elements whose twists are measured
    integer, allocatable :: free(:)        !! states that are the speeds of the rigid motions
    integer :: moving = 0                  !! the state `moving` places after a speed is its angle
    integer :: states = 0
    type(sparse_map_t), private :: map                !! from the states to the quantities
    real(wp), allocatable, private :: offset(:, :)    !! of their sizes, [lanes, count]
  contains
    procedure :: measure, describe_map, start_lane, twist_of, state_of, pass_parameters
  end type error_measures_t

  real(wp), parameter :: rounding = 1.0e-6_wp   !! of a large angle within a step: rtol times this is above its rounding

contains

  !> The measures of a first-order system whose first states are `moving` speeds, and then their angles.
  function new_error_measures(coupling, first, column, ratio, free, moving, states, without_bands) result(self)
    integer, intent(in) :: coupling(:)      !! elements whose twists are measured
    integer, intent(in) :: first(:)         !! first entry of each, [couplings + 1]
    integer, intent(in) :: column(:)        !! speed to which each entry belongs, [entries]
    real(wp), intent(in) :: ratio(:, :)     !! twist of the element for that angle, [lanes, entries]
    integer, intent(in) :: free(:)          !! speeds of the rigid motions
    integer, intent(in) :: moving, states   !! numbers of speeds and of all states
    logical, intent(in) :: without_bands    !! as in `new_sparse_map`
    type(error_measures_t) :: self
    integer, allocatable :: all_first(:), all_column(:)
    real(wp), allocatable :: all_ratio(:, :)
    integer :: entries, i, singles

    entries = size(column)
    singles = states - 2 * moving
    allocate (self%coupling, source=coupling)
    allocate (self%free, source=free)
    self%moving = moving
    self%states = states
    self%count = 2 * (size(coupling) + size(free)) + singles
    allocate (all_first(self%count + 1))
    associate (twists => size(coupling), motions => size(free))
      all_first(:twists + 1) = first
      all_first(twists + 2:twists + motions + 1) = first(twists + 1) + [(i, i=1, motions)]
      all_first(twists + motions + 2:2 * twists + motions + 1) = all_first(twists + motions + 1) + first(2:) - 1
      all_first(2 * twists + motions + 2:) = all_first(2 * twists + motions + 1) + [(i, i=1, singles + motions)]
    end associate
    allocate (all_column, source=[column, free, column + moving, (2 * moving + i, i=1, singles), free + moving])
    allocate (all_ratio(size(ratio, 1), size(all_column)), source=1.0_wp)
    all_ratio(:, :entries) = ratio
    all_ratio(:, entries + size(free) + 1:2 * entries + size(free)) = ratio
    self%map = new_sparse_map(all_first, all_column, all_ratio, without_bands=without_bands)
    allocate (self%offset(size(ratio, 1), self%count), source=0.0_wp)
  end function new_error_measures

  !> The sizes of the quantities at the state y, and an error of the state in them.
  subroutine measure(self, lanes, columns, y, error, sizes, errors)
    class(error_measures_t), intent(in) :: self
    integer, intent(in) :: lanes, columns
    real(wp), intent(in), dimension(lanes, columns) :: y, error   !! [lanes, states], at least
    real(wp), intent(inout), dimension(lanes, self%count) :: sizes, errors

    call self%map%multiply_pair(self%offset, y, error, sizes, errors)
    associate (phases => self%count - size(self%free) + 1)
      sizes(:, phases:) = 1.0_wp + rounding * abs(sizes(:, phases:))
    end associate
  end subroutine measure

  !> Describes the map of several lanes for plain steps.
  subroutine describe_map(self, steps)
    class(error_measures_t), target, intent(in) :: self
    type(plain_steps_t), intent(inout) :: steps

    steps%phases = self%count - size(self%free)
    steps%rounding = rounding
    steps%first = c_loc(self%map%first)
    steps%column = c_loc(self%map%column)
    steps%coefficient = c_loc(self%map%coefficient)
    steps%offset = c_loc(self%offset)
  end subroutine describe_map

  !> Counts the sizes of a lane that starts at the state y.
  pure subroutine start_lane(self, lane, y, twist_at_zero, rest)
    class(error_measures_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: y(:)               !! [states], at least
    real(wp), intent(in) :: twist_at_zero(:)   !! of the elements where the angles of the state are zero [rad], [elements]
    real(wp), intent(in) :: rest(:)            !! their rest angles [rad], [elements]

    associate (twists => size(self%coupling), motions => size(self%free))
      self%offset(lane, twists + 1:twists + motions) = -y(self%free)
      self%offset(lane, twists + motions + 1:2 * twists + motions) = twist_at_zero(self%coupling) - rest(self%coupling)
    end associate
  end subroutine start_lane

  !> The element whose twist, or whose rate of twist, a quantity is; 0 if it is none.
  pure integer function twist_of(self, index)
    class(error_measures_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to count

    twist_of = 0
    associate (twists => size(self%coupling), motions => size(self%free))
      if (index <= twists) twist_of = self%coupling(index)
      if (index > twists + motions .and. index <= 2 * twists + motions) twist_of = self%coupling(index - twists - motions)
    end associate
  end function twist_of

  !> The state that a quantity is, if it is no twist.
  pure integer function state_of(self, index)
    class(error_measures_t), intent(in) :: self
    integer, intent(in) :: index   !! 1 to count

    associate (twists => size(self%coupling), motions => size(self%free))
      if (index <= twists + motions) then
        state_of = self%free(index - twists)
      else if (index > self%count - motions) then
        state_of = self%free(index - (self%count - motions)) + self%moving
      else
        state_of = index - (2 * twists + motions) + 2 * self%moving
      end if
    end associate
  end function state_of

  !> Passes the arrays that may differ from variant to variant, without those that `start_lane` sets.
  subroutine pass_parameters(self, parameters)
    class(error_measures_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    call parameters%add_structure(self%coupling, self%free)
    call self%map%pass_parameters(parameters)
  end subroutine pass_parameters

end module nocdyn_error_measures
