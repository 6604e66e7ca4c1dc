!> The numbers that the design of a sweep varies, and the numbers of the input that each of them sets: one, or several that a
!> pattern ties to each other.
module nocdyn_varied_numbers
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_target_consistency, only: find_targets, target_at
  use nocdyn_target_patterns, only: expand_path
  use nocdyn_targets, only: target_t
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: find_varied_numbers

  !> A number of the design.
  type, public :: varied_number_t
    character(len=:), allocatable :: path        !! as written
    character(len=:), allocatable :: unit        !! of its values, '' if it has none
    character(len=:), allocatable :: long_name   !! a description
    logical :: is_relative = .false.             !! it multiplies the numbers of the input
    logical :: is_integer = .false.              !! values are rounded to the nearest integer
  end type varied_number_t

  type, public :: varied_numbers_t
    type(varied_number_t), allocatable :: list(:)
    type(target_t), allocatable :: targets(:)     !! of the first number, of the second one, ...
    integer, allocatable, private :: number(:)    !! that sets a target, [targets]
    real(wp), allocatable, private :: base(:)     !! that a relative number multiplies, in the unit of the target, [targets]
  contains
    procedure :: target_values, round, number_at
  end type varied_numbers_t

contains

  !> Finds the numbers of the input by their paths. Those with a message have no targets.
  subroutine find_varied_numbers(input, paths, are_relative, self, messages)
    type(input_t), intent(in) :: input
    type(string_t), intent(in) :: paths(:)
    logical, intent(in) :: are_relative(:)                    !! [paths]
    type(varied_numbers_t), intent(out) :: self
    type(string_t), allocatable, intent(out) :: messages(:)   !! [paths], '' if nothing is wrong
    type(string_t), allocatable :: all_paths(:), expanded(:), reasons(:)
    type(target_t), allocatable :: targets(:)
    integer, allocatable :: number(:)   ! of each path in `all_paths`
    integer :: i, k

    allocate (self%list(size(paths)), messages(size(paths)), all_paths(0), number(0))
    do i = 1, size(paths)
      call expand_path(input, trim(adjustl(paths(i)%text)), expanded, messages(i)%text)
      do k = 1, size(expanded)
        call append(all_paths, expanded(k)%text)
      end do
      number = [number, [(i, k=1, size(expanded))]]
    end do
    call find_targets(input, all_paths, number, targets, reasons)
    do k = 1, size(targets)
      if (messages(number(k))%text /= '' .or. reasons(k)%text == '') cycle
      messages(number(k))%text = reasons(k)%text
      if (count(number == number(k)) > 1) messages(number(k))%text = all_paths(k)%text // ': ' // reasons(k)%text
    end do
    call keep_targets(self, [(messages(number(k))%text == '', k=1, size(targets))], targets, number)
    do i = 1, size(paths)
      call describe(self, i, trim(adjustl(paths(i)%text)), are_relative(i))
      if (are_relative(i) .and. messages(i)%text == '') call find_bases(input, self, i, messages(i)%text)
    end do
  end subroutine find_varied_numbers

  !> Takes those targets that are right.
  subroutine keep_targets(self, are_right, targets, number)
    type(varied_numbers_t), intent(inout) :: self
    logical, intent(in) :: are_right(:)            !! [targets]
    type(target_t), intent(in) :: targets(:)
    integer, intent(in) :: number(:)               !! [targets]
    integer :: k, kept

    allocate (self%targets(count(are_right)))
    kept = 0
    do k = 1, size(targets)
      if (.not. are_right(k)) cycle
      kept = kept + 1
      self%targets(kept) = targets(k)
    end do
    self%number = pack(number, are_right)
    allocate (self%base(kept), source=1.0_wp)
  end subroutine keep_targets

  !> Names a number.
  subroutine describe(self, number, path, is_relative)
    type(varied_numbers_t), intent(inout) :: self
    integer, intent(in) :: number
    character(len=*), intent(in) :: path
    logical, intent(in) :: is_relative
    integer :: first, tied

    associate (this => self%list(number))
      this%path = path
      this%unit = ''
      this%long_name = ''
      this%is_relative = is_relative
      first = findloc(self%number, number, dim=1)
      if (first == 0) return
      this%unit = self%targets(first)%unit
      if (is_relative) this%unit = '1'
      this%is_integer = self%targets(first)%is_integer .and. .not. is_relative
      this%long_name = self%targets(first)%long_name
      tied = count(self%number == number)
      if (tied > 1) this%long_name = this%long_name // ' (and of ' // to_text(tied - 1) // ' more)'
      if (is_relative) this%long_name = 'factor of ' // this%long_name
    end associate
  end subroutine describe

  !> Finds what a relative number multiplies: values other than 0.
  subroutine find_bases(input, self, number, message)
    type(input_t), intent(in) :: input
    type(varied_numbers_t), intent(inout) :: self
    integer, intent(in) :: number
    character(len=:), allocatable, intent(inout) :: message
    integer :: k

    do k = 1, size(self%targets)
      if (self%number(k) /= number) cycle
      associate (target => self%targets(k))
        associate (value => input%groups(target%group)%values(target%key))
          self%base(k) = 0.0_wp
          if (value%count() >= target%position) self%base(k) = value%number_at(target%position)
        end associate
        target%in_unit = 0   ! bases are in SI
      end associate
    end do
    if (any(abs(self%base) > 0 .and. self%number == number)) return
    message = "scale = 'relative' multiplies the value in the input, and that is 0 or not given; needed: another value, " // &
              "or scale = 'absolute'"
  end subroutine find_bases

  !> The values of the targets.
  pure subroutine target_values(self, x, values)
    class(varied_numbers_t), intent(in) :: self
    real(wp), intent(in) :: x(:)           !! of the numbers, rounded, [numbers]
    real(wp), intent(out) :: values(:)     !! [targets]
    integer :: k

    do k = 1, size(values)
      values(k) = x(self%number(k))
      if (self%list(self%number(k))%is_relative) values(k) = values(k) * self%base(k)
    end do
  end subroutine target_values

  !> Rounds the values of integers.
  pure subroutine round(self, x)
    class(varied_numbers_t), intent(in) :: self
    real(wp), intent(inout) :: x(:)   !! [numbers]

    where (self%list%is_integer) x = anint(x)
  end subroutine round

  !> The number that gives the value at a path of the input, whatever that was before; 0 if there is none.
  integer function number_at(self, input, path) result(number)
    class(varied_numbers_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: path
    integer :: k

    number = 0
    k = target_at(input, self%targets, path)
    if (k == 0) return
    if (.not. self%list(self%number(k))%is_relative) number = self%number(k)
  end function number_at

end module nocdyn_varied_numbers
