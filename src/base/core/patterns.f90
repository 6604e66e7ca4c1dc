!> Patterns of names.
module nocdyn_patterns
  implicit none (type, external)
  private

  public :: matches

contains

  !> Whether a name is of the form of a pattern, in which * stands for any characters or none.
  pure logical function matches(pattern, name)
    character(len=*), intent(in) :: pattern, name
    integer :: after_star, i, k, star   ! in `name`, `pattern`: the last star takes the characters before `after_star`

    i = 1
    k = 1
    star = 0
    after_star = 1
    matches = .false.
    do while (i <= len(name))
      if (index(pattern(k:), '*') == 1) then
        star = k
        after_star = i
        k = k + 1
      else if (index(pattern(k:), name(i:i)) == 1) then
        k = k + 1
        i = i + 1
      else if (star > 0) then
        after_star = after_star + 1
        i = after_star
        k = star + 1
      else
        return
      end if
    end do
    matches = verify(pattern(k:), '*') == 0
  end function matches

end module nocdyn_patterns
