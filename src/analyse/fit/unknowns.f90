!> The numbers that a fit finds: &unknown of an input.
module nocdyn_unknowns
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_target_consistency, only: check_consistency
  use nocdyn_target_patterns, only: expand_path
  use nocdyn_targets, only: find_target, set_targets, target_t
  use nocdyn_text, only: string_t, to_text
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: read_unknowns, set_unknowns

  !> One unknown: a number, or several that have the same value.
  type, public :: unknown_t
    integer :: group = 0                       !! &unknown in the input
    character(len=:), allocatable :: path      !! as the input writes it
    character(len=:), allocatable :: unit
    type(target_t), allocatable :: targets(:)
    real(wp) :: before = 0.0_wp                !! value in the input, of the first one
    real(wp) :: low = 0.0_wp, high = 0.0_wp, start = 0.0_wp
    logical :: has_prior = .false.
    real(wp) :: prior = 0.0_wp, deviation = 0.0_wp   !! what is expected, with its standard deviation
  end type unknown_t

contains

  !> Reads all unknowns.
  subroutine read_unknowns(input, unknowns, error)
    type(input_t), intent(in) :: input
    type(unknown_t), allocatable, intent(out) :: unknowns(:)
    type(error_t), allocatable, intent(out) :: error   !! names file, line, group and key
    type(diagnostics_t) :: diagnostics
    integer, allocatable :: groups(:)
    integer :: i, k, n

    allocate (groups, source=input%groups_named('unknown'))
    allocate (unknowns(size(groups)))
    do i = 1, size(groups)
      call read_one(input, groups(i), unknowns(i), diagnostics)
      if (.not. allocated(unknowns(i)%targets)) cycle
      do k = 1, i - 1
        if (.not. allocated(unknowns(k)%targets)) cycle
        do n = 1, size(unknowns(i)%targets)
          if (.not. any(same(unknowns(k)%targets, unknowns(i)%targets(n)))) cycle
          call input%report(groups(i), 'target', 'target: ' // unknowns(i)%targets(n)%path // ' is the unknown ' // &
                            to_text(k) // ' already; allowed: once', diagnostics)
          exit
        end do
      end do
    end do
    call input%refuse(diagnostics, error)
  end subroutine read_unknowns

  elemental logical function same(first, second)
    type(target_t), intent(in) :: first, second

    same = first%group == second%group .and. first%key == second%key .and. first%position == second%position
  end function same

  subroutine read_one(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g
    type(unknown_t), intent(inout) :: self
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t), allocatable :: paths(:)
    type(target_t), allocatable :: targets(:)
    character(len=:), allocatable :: message
    integer :: i

    self%group = g
    associate (group => input%groups(g))
      self%path = group%text('target')
      call expand_path(input, self%path, paths, message)
      if (message == '') then
        allocate (targets(size(paths)))
        do i = 1, size(paths)
          call find_target(input, paths(i)%text, targets(i), message)
          if (message == '' .and. targets(i)%is_integer) message = paths(i)%text // ' is a whole number; allowed: other numbers'
          if (message == '') call check_consistency(input, targets, i, message)
          if (message /= '') exit
        end do
      end if
      if (message /= '') then
        call input%report(g, 'target', 'target: ' // message, diagnostics)
        return
      end if
      self%unit = targets(1)%unit
      self%low = group%number('low')
      self%high = group%number('high')
      self%before = value_in(input, targets(1))
      self%start = group%number('start', absent=min(self%high, max(self%low, self%before)))
      self%has_prior = group%has_value('prior')
      self%prior = group%number('prior', absent=0.0_wp)
      self%deviation = group%number('deviation', absent=1.0_wp)
      if (self%start < self%low .or. self%start > self%high) then
        call input%report(g, 'start', 'start = ' // to_text(self%start) // ' is out of range; allowed: ' // &
                          to_text(self%low) // ' to ' // to_text(self%high), diagnostics)
      end if
      call move_alloc(targets, self%targets)
      call check_ends(input, self, diagnostics)
    end associate
  end subroutine read_one

  !> Whether the keys allow the lowest and the highest value.
  subroutine check_ends(input, self, diagnostics)
    type(input_t), intent(in) :: input
    type(unknown_t), intent(in) :: self
    type(diagnostics_t), intent(inout) :: diagnostics
    type(input_t) :: changed
    character(len=:), allocatable :: message
    integer :: i

    changed = input
    do i = 1, 2
      call set_targets(changed, self%targets, spread(merge(self%low, self%high, i == 1), 1, size(self%targets)), message)
      if (message == '') cycle
      call input%report(self%group, trim(merge('low ', 'high', i == 1)), &
                        trim(merge('low ', 'high', i == 1)) // ': ' // message, diagnostics)
    end do
  end subroutine check_ends

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

  !> Gives an input the values of all unknowns.
  subroutine set_unknowns(input, unknowns, values, message)
    type(input_t), intent(inout) :: input
    type(unknown_t), intent(in) :: unknowns(:)
    real(wp), intent(in) :: values(:)   !! [unknowns], in the units of their targets
    character(len=:), allocatable, intent(out) :: message   !! what is not allowed, '' if all are
    integer :: i

    message = ''
    do i = 1, size(unknowns)
      call set_targets(input, unknowns(i)%targets, spread(values(i), 1, size(unknowns(i)%targets)), message)
      if (message /= '') return
    end do
  end subroutine set_unknowns

end module nocdyn_unknowns
