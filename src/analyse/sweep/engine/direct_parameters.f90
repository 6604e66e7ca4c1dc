!> Targets of a sweep whose values stand in the numbers of a lane as they are, so that a variant is set by writing them there.
!>
!> Two things must come together. Banks list an array by the name of the key whose values they take for it as they are, laws
!> are copies of such numbers or of their negatives, and what else an assembly asks of such a value is its sign. And this is
!> tried for the machine at hand: with two values of each sign, and with zero, a target must move the same numbers, all of them
!> in such arrays and each the value or its negative, and nothing else, the start included. Signs with which it does otherwise
!> or changes the layout are left to assembly; so are all variants if two targets move one number.
module nocdyn_direct_parameters
  use, intrinsic :: iso_fortran_env, only: int64
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t, parameter_index_t
  implicit none (type, external)
  private

  public :: new_direct_parameters, trial_value

  integer, parameter, public :: trials = 5   !! of each target
  real(wp), parameter :: trial_factors(trials) = [1.37_wp, 0.61_wp, -1.37_wp, -0.61_wp, 0.0_wp]   ! of the size of a value
  integer, parameter :: trials_of_sign(-1:1) = [2, 1, 2]

  type :: direct_parameter_t
    character(len=:), allocatable :: key
    logical :: is_exempt = .false.                 !! somebody else sets it
    integer :: passed(-1:1) = 0                    !! trials of each sign
    logical :: may_be(-1:1) = .false.              !! whether values of each sign are plain
    logical :: is_zero_at_origin = .false.
    real(wp) :: lowest, highest                    !! allowed values, as far as they are known
    type(parameter_index_t), allocatable :: place(:)         !! not allocated: no trial has passed
    logical, allocatable :: is_negative(:)         !! whether the number there is the negative of the value
  end type direct_parameter_t

  type, public :: direct_parameters_t
    logical :: are_direct = .false.                 !! after `conclude`: whether values of some signs are, for every target
    type(direct_parameter_t), allocatable, private :: target(:)
  contains
    procedure :: exempt
    procedure :: judge
    procedure :: conclude
    procedure :: may_take
    procedure :: have_seen
    procedure :: see
    procedure :: write_values
  end type direct_parameters_t

contains

  !> Targets that have been tried with nothing but the values `reference`.
  function new_direct_parameters(reference) result(self)
    real(wp), intent(in) :: reference(:)
    type(direct_parameters_t) :: self

    allocate (self%target(size(reference)))
    self%target%lowest = reference
    self%target%highest = reference
    self%target%is_zero_at_origin = .not. abs(reference) > 0
  end function new_direct_parameters

  !> Leaves a target, of positive values, to somebody else, who sets other numbers than plain ones.
  subroutine exempt(self, target)
    class(direct_parameters_t), intent(inout) :: self
    integer, intent(in) :: target

    associate (one => self%target(target))
      one%is_exempt = .true.
      one%may_be = [.false., .false., .true.]
      allocate (one%place(0), one%is_negative(0))
    end associate
  end subroutine exempt

  !> The value of trial number 1 to `trials` of a target.
  pure real(wp) function trial_value(reference, number) result(value)
    real(wp), intent(in) :: reference
    integer, intent(in) :: number

    value = trial_factors(number) * merge(abs(reference), 1.0_wp, abs(reference) > 0)
  end function trial_value

  !> Judges a trial of one target, whose numbers are congruent with those of the origin.
  subroutine judge(self, target, key, value, reference, tried)
    class(direct_parameters_t), intent(inout) :: self
    integer, intent(in) :: target
    character(len=*), intent(in) :: key                 !! of the target
    real(wp), intent(in) :: value
    type(lane_parameters_t), intent(in) :: reference, tried   !! of one lane
    type(parameter_index_t), allocatable :: places(:)
    logical, allocatable :: negative(:)
    integer :: i

    if (.not. tried%has_same_curves(1, reference, 1)) return
    allocate (places, source=tried%differences(1, reference, 1))
    allocate (negative, source=[(.not. same_bits(tried%value(places(i), 1), value), i=1, size(places))])
    do i = 1, size(places)
      if (.not. same_bits(tried%value(places(i), 1), signed(value, negative(i)))) return
      if (.not. is_copied(tried%name_at(places(i)), key)) return
    end do
    associate (one => self%target(target))
      if (.not. allocated(one%place)) then
        one%place = places
        one%is_negative = negative
      else if (abs(value) > 0 .or. size(places) > 0) then   ! a zero moves nothing from a zero
        if (.not. are_same(one%place, places)) return
        if (any(one%is_negative .neqv. negative)) return
      end if
      one%passed(sign_of(value)) = one%passed(sign_of(value)) + 1
    end associate
  end subroutine judge

  !> Whether the numbers of an array are values of a key as they are, or their negatives.
  pure logical function is_copied(name, key)
    character(len=*), intent(in) :: name, key

    is_copied = name == key .or. index(name, 'laws: ') == 1
  end function is_copied

  pure logical function same_bits(a, b)
    real(wp), intent(in) :: a, b

    same_bits = transfer(a, 0_int64) == transfer(b, 0_int64)
  end function same_bits

  pure real(wp) function signed(value, is_negative)
    real(wp), intent(in) :: value
    logical, intent(in) :: is_negative

    signed = value
    if (is_negative) signed = -value
  end function signed

  pure integer function sign_of(value)
    real(wp), intent(in) :: value

    sign_of = 0
    if (abs(value) > 0) sign_of = nint(sign(1.0_wp, value))
  end function sign_of

  pure logical function are_same(a, b)
    type(parameter_index_t), intent(in) :: a(:), b(:)

    are_same = size(a) == size(b)
    if (are_same) are_same = all(a%array == b%array .and. a%row == b%row .and. a%column == b%column)
  end function are_same

  !> Which signs are plain, once all trials have been judged.
  subroutine conclude(self)
    class(direct_parameters_t), intent(inout) :: self
    integer :: i, j, k

    self%are_direct = .true.
    do i = 1, size(self%target)
      associate (one => self%target(i))
        if (one%is_exempt) cycle
        one%may_be = one%passed == trials_of_sign
        self%are_direct = self%are_direct .and. any(one%may_be)
        if (.not. self%are_direct) return
        do j = 1, i - 1
          do k = 1, size(one%place)
            if (any(are_at(self%target(j)%place, one%place(k)))) self%are_direct = .false.
          end do
        end do
      end associate
    end do
  end subroutine conclude

  elemental logical function are_at(a, b)
    type(parameter_index_t), intent(in) :: a, b

    are_at = a%array == b%array .and. a%row == b%row .and. a%column == b%column
  end function are_at

  !> Whether values are plain by their signs; the zeros of arithmetic, not its negative ones. Only single zeros have been tried:
  !> of two, e.g. the last terms of a law, each may be plain where both are not.
  pure logical function may_take(self, values)
    class(direct_parameters_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer :: i, zeros

    may_take = .false.
    zeros = 0
    do i = 1, size(self%target)
      if (.not. abs(values(i)) > 0 .and. .not. self%target(i)%is_zero_at_origin) zeros = zeros + 1
      if (zeros > 1) return
      if (values(i) > 0) then
        if (.not. self%target(i)%may_be(1)) return
      else if (values(i) < 0) then
        if (.not. self%target(i)%may_be(-1)) return
      else
        if (.not. self%target(i)%may_be(0) .or. .not. same_bits(values(i), 0.0_wp)) return
      end if
    end do
    may_take = .true.
  end function may_take

  !> Whether values are between those that are known to be allowed. Ranges of keys have no holes but zero, which has a sign of
  !> its own here.
  pure logical function have_seen(self, values)
    class(direct_parameters_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer :: i

    have_seen = .false.
    do i = 1, size(self%target)
      if (.not. (values(i) >= self%target(i)%lowest .and. values(i) <= self%target(i)%highest)) return
    end do
    have_seen = .true.
  end function have_seen

  !> Takes values that have been found to be allowed.
  subroutine see(self, values)
    class(direct_parameters_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: values(:)

    self%target%lowest = min(self%target%lowest, values)
    self%target%highest = max(self%target%highest, values)
  end subroutine see

  !> Writes values into a lane that has the numbers of the origin elsewhere.
  subroutine write_values(self, values, lane, parameters)
    class(direct_parameters_t), intent(in) :: self
    real(wp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: lane
    type(lane_parameters_t), intent(inout) :: parameters
    integer :: i, k

    do i = 1, size(self%target)
      associate (one => self%target(i))
        do k = 1, size(one%place)
          call parameters%set_value(one%place(k), lane, signed(values(i), one%is_negative(k)))
        end do
      end associate
    end do
  end subroutine write_values

end module nocdyn_direct_parameters
