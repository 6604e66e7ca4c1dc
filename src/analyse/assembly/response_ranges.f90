!> The ranges of speeds of &response, which every command checks.
module nocdyn_response_ranges
  use nocdyn_errors, only: add_mistake, error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: rounded_text, to_text
  use nocdyn_units, only: from_si, unit_rpm
  use nocdyn_written_values, only: unit_of, written_key, written_number
  implicit none (type, external)
  private

  public :: check_response_range

contains

  !> Refuses ranges that begin with the faster speed, or whose ends differ in direction.
  subroutine check_response_range(input, index, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: index   !! of the group
    type(error_t), allocatable, intent(inout) :: error

    associate (group => input%groups(index))
      call check_range(input, index, 'speed', group%numbers('speed'), error)
      call check_range(input, index, 'operating', group%numbers('operating'), error)
    end associate
  end subroutine check_response_range

  !> Two speeds are the lowest and the highest one, in the same direction. The ones of a response may be one.
  subroutine check_range(input, group, key, range, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: range(:)   !! [rad/s], or empty
    type(error_t), allocatable, intent(inout) :: error
    character(len=:), allocatable :: text

    if (size(range) == 0) return
    if (size(range) == 1 .and. key == 'speed') return
    if (size(range) > 2) then
      call add_mistake(error, input%location(group, key) // ': ' // to_text(size(range)) // ' speeds; allowed: one, ' // &
                 'or the slowest and the fastest one')
      return
    end if
    if (range(1) * range(2) > 0 .and. abs(range(1)) < abs(range(2))) return
    if (key == 'speed' .and. .not. abs(range(1) - range(2)) > 0) return
    associate (written => input%groups(group))
      text = written_key(written, key) // ' = ' // written_number(written, key, range(1)) // ', ' // &
             written_number(written, key, range(2))
      if (unit_of(written, key) == 0) text = text // ' rad/s, which is ' // rounded_text(from_si(range(1), unit_rpm), 6) // &
                                             ', ' // rounded_text(from_si(range(2), unit_rpm), 6) // ' rpm'
    end associate
    call add_mistake(error, input%location(group, key) // ': ' // text // '; allowed: first the slower speed, then ' // &
               'the faster one, both with one sign')
  end subroutine check_range

end module nocdyn_response_ranges
