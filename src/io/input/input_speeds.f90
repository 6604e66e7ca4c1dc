!> The speeds and frequencies that an input gives.
module nocdyn_input_speeds
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_schema, only: first_key, group_rules, key_rules, last_key
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: given_speeds

  !> Numbers with their names.
  type, public :: named_speeds_t
    type(string_t), allocatable :: labels(:)   !! e.g. 'mains synchronous_speed'
    real(wp), allocatable :: speeds(:)         !! none is 0 [rad/s]
  end type named_speeds_t

contains

  !> The numbers in rad/s that an input gives, but for the ones of bodies, which may follow from gears. Of lists these are the
  !> first and the last number. Zeros are left out.
  function given_speeds(input) result(found)
    type(input_t), intent(in) :: input
    type(named_speeds_t) :: found
    type(named_speeds_t) :: all
    integer :: g, i, key, n, rule

    n = 0
    allocate (all%labels(2 * size(input%groups) * most_keys()), all%speeds(2 * size(input%groups) * most_keys()))
    do g = 1, size(input%groups)
      if (input%groups(g)%kind == 'body') cycle
      do key = 1, size(input%groups(g)%values)
        rule = first_key(input%groups(g)%rule) + key - 1
        associate (value => input%groups(g)%values(key))
          if (key_rules(rule)%unit /= 'rad/s' .or. .not. value%is_given) cycle
          do i = 1, value%count(), max(1, value%count() - 1)
            if (abs(value%numbers(i)) <= 0.0_wp) cycle
            n = n + 1
            all%labels(n)%text = input%groups(g)%name // ' ' // trim(key_rules(rule)%name)
            if (value%count() > 1) all%labels(n)%text = all%labels(n)%text // '(' // to_text(i) // ')'
            all%speeds(n) = value%numbers(i)
          end do
        end associate
      end do
    end do
    found%labels = all%labels(:n)
    found%speeds = all%speeds(:n)
  end function given_speeds

  !> The largest number of keys in rad/s of any group.
  pure integer function most_keys()
    integer :: g

    most_keys = maxval([(count(key_rules(first_key(g):last_key(g))%unit == 'rad/s'), g=1, size(group_rules))])
  end function most_keys

end module nocdyn_input_speeds
