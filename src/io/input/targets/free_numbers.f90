!> Numbers of an input that are sought between bounds: one, or several that have the same value.
module nocdyn_free_numbers
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_target_consistency, only: check_consistency
  use nocdyn_target_patterns, only: expand_path
  use nocdyn_targets, only: find_target, set_targets, target_t
  use nocdyn_text, only: append, string_t, to_text
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: note_starts, read_free_number, refuse_twice, set_free_numbers

  type, public :: free_number_t
    integer :: group = 0                       !! in the input, that asks for it by `target`
    character(len=:), allocatable :: path      !! as the input writes it
    character(len=:), allocatable :: unit
    type(target_t), allocatable :: targets(:)
    real(wp) :: before = 0.0_wp                !! value in the input, of the first one
    real(wp) :: low = 0.0_wp, high = 0.0_wp, start = 0.0_wp
  end type free_number_t

contains

  !> Reads the target of a group, and its start if it has one.
  subroutine read_free_number(input, g, low, high, takes_integers, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g                   !! with the keys target and start
    real(wp), intent(in) :: low, high
    logical, intent(in) :: takes_integers
    class(free_number_t), intent(inout) :: self   !! without targets if they are wrong
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: paths(:)
    type(target_t), allocatable :: targets(:)
    character(len=:), allocatable :: message
    integer :: i

    self%group = g
    self%low = low
    self%high = high
    associate (group => input%groups(g))
      self%path = group%text('target')
      call expand_path(input, self%path, paths, message)
      if (message == '') then
        allocate (targets(size(paths)))
        do i = 1, size(paths)
          call find_target(input, paths(i)%text, targets(i), message)
          if (message == '' .and. targets(i)%is_integer .and. .not. takes_integers) then
            message = paths(i)%text // ' is a whole number; allowed: other numbers'
          end if
          if (message == '') call check_consistency(input, targets, i, message)
          if (message /= '') exit
        end do
      end if
      if (message /= '') then
        call input%report(g, 'target', 'target: ' // message, diagnostics)
        return
      end if
      self%unit = targets(1)%unit
      self%before = value_in(input, targets(1))
      self%start = group%number('start', absent=min(high, max(low, self%before)))
      if (self%start < low .or. self%start > high) then
        call input%report(g, 'start', 'start = ' // to_text(self%start) // ' is out of range; allowed: ' // &
                          to_text(low) // ' to ' // to_text(high), diagnostics)
      end if
      call move_alloc(targets, self%targets)
    end associate
    call check_ends(input, self, diagnostics)
  end subroutine read_free_number

  !> Whether the keys allow the lowest and the highest value.
  subroutine check_ends(input, self, diagnostics)
    type(input_t), intent(in) :: input
    class(free_number_t), intent(in) :: self
    type(diagnostics_t), intent(inout) :: diagnostics
    type(input_t) :: changed
    character(len=:), allocatable :: key, message
    integer :: i

    changed = input
    do i = 1, 2
      call set_targets(changed, self%targets, spread(merge(self%low, self%high, i == 1), 1, size(self%targets)), message)
      if (message == '') cycle
      key = trim(merge('low ', 'high', i == 1))
      if (.not. input%groups(self%group)%has_value(key)) key = 'target'
      call input%report(self%group, key, key // ': ' // message, diagnostics)
    end do
  end subroutine check_ends

  !> Notes on numbers that do not begin with what the input has: beyond their bounds, or several values for one number.
  subroutine note_starts(input, numbers, notes)
    type(input_t), intent(in) :: input
    class(free_number_t), intent(in) :: numbers(:)   !! read without mistakes
    type(string_t), allocatable, intent(out) :: notes(:)
    integer :: i, k

    allocate (notes(0))
    do i = 1, size(numbers)
      associate (one => numbers(i))
        if ((one%before < one%low .or. one%before > one%high) .and. .not. input%groups(one%group)%has_value('start')) then
          call append(notes, one%path // ' = ' // to_text(one%before) // ' of the input is not between low and high: it ' // &
                             'begins at ' // to_text(one%start))
        end if
        do k = 2, size(one%targets)
          if (.not. abs(value_in(input, one%targets(k)) - one%before) > 0) cycle
          call append(notes, one%path // ' has several values in the input, of which the first, ' // to_text(one%before) // &
                             ', is shown as that before: all get one value')
          exit
        end do
      end associate
    end do
  end subroutine note_starts

  !> The value of a number in its unit; 0 if the input gives none.
  pure real(wp) function value_in(input, target) result(value)
    type(input_t), intent(in) :: input
    type(target_t), intent(in) :: target

    value = 0.0_wp
    associate (values => input%groups(target%group)%values(target%key))
      if (.not. allocated(values%numbers)) return
      if (target%position <= size(values%numbers)) value = from_si(values%numbers(target%position), target%in_unit)
    end associate
  end function value_in

  !> Refuses the last number if a target of it is one of another number.
  subroutine refuse_twice(input, numbers, noun, diagnostics)
    type(input_t), intent(in) :: input
    class(free_number_t), intent(in) :: numbers(:)
    character(len=*), intent(in) :: noun   !! 'unknown'
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: k, n

    associate (last => numbers(size(numbers)))
      if (.not. allocated(last%targets)) return
      do k = 1, size(numbers) - 1
        if (.not. allocated(numbers(k)%targets)) cycle
        do n = 1, size(last%targets)
          if (.not. any(same(numbers(k)%targets, last%targets(n)))) cycle
          call input%report(last%group, 'target', 'target: ' // last%targets(n)%path // ' is the ' // noun // ' ' // &
                            to_text(k) // ' already; allowed: once', diagnostics)
          exit
        end do
      end do
    end associate
  end subroutine refuse_twice

  elemental logical function same(first, second)
    type(target_t), intent(in) :: first, second

    same = first%group == second%group .and. first%key == second%key .and. first%position == second%position
  end function same

  !> Gives an input the values of all numbers.
  subroutine set_free_numbers(input, numbers, values, message)
    type(input_t), intent(inout) :: input
    class(free_number_t), intent(in) :: numbers(:)
    real(wp), intent(in) :: values(:)   !! [numbers], in the units of their targets
    character(len=:), allocatable, intent(out) :: message   !! what is not allowed, '' if all are
    integer :: i

    message = ''
    do i = 1, size(numbers)
      call set_targets(input, numbers(i)%targets, spread(values(i), 1, size(numbers(i)%targets)), message)
      if (message /= '') return
    end do
  end subroutine set_free_numbers

end module nocdyn_free_numbers
