!> What may be chosen: &design of an input, numbers between bounds, numbers of a list, and sizes of catalogues.
module nocdyn_design_choices
  use nocdyn_catalogues, only: list_sizes
  use nocdyn_errors, only: error_t
  use nocdyn_free_numbers, only: free_number_t, read_free_number, refuse_twice
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: read_choices

  !> One number that is chosen.
  type, extends(free_number_t), public :: design_number_t
    logical :: is_continuous = .true.       !! else one of `values`
    logical :: is_logarithmic = .false.     !! whether it is searched by its logarithm
    real(wp), allocatable :: values(:)
  contains
    procedure :: at, has => has_number, share_of
  end type design_number_t

  !> One size of a catalogue that is chosen.
  type, public :: design_size_t
    integer :: group = 0                        !! &coupling in the input
    character(len=:), allocatable :: path       !! 'coupling.rubber.size'
    type(string_t), allocatable :: sizes(:)
  contains
    procedure :: has => has_size
  end type design_size_t

  integer, parameter :: most_values = 10000           ! of one number
  real(wp), parameter :: rounding = 1.0e-9_wp         ! of a number of steps
  real(wp), parameter :: wide = 10.0_wp               ! ratio of bounds of a logarithmic number
  character(len=*), parameter :: coupling = 'coupling.', size_key = '.size'

contains

  !> Reads all groups &design.
  subroutine read_choices(input, numbers, sizes, error)
    type(input_t), intent(in) :: input
    type(design_number_t), allocatable, intent(out) :: numbers(:)
    type(design_size_t), allocatable, intent(out) :: sizes(:)
    type(error_t), allocatable, intent(out) :: error   !! names file, line, group and key
    type(diagnostics_t) :: diagnostics
    integer, allocatable :: groups(:)
    logical :: is_size(size(input%groups_named('design')))
    integer :: i, n, s

    allocate (groups, source=input%groups_named('design'))
    do i = 1, size(groups)
      is_size(i) = names_size(input%groups(groups(i))%text('target'))
    end do
    allocate (numbers(count(.not. is_size)), sizes(count(is_size)))
    n = 0
    s = 0
    do i = 1, size(groups)
      if (is_size(i)) then
        s = s + 1
        call read_size(input, groups(i), sizes(s), diagnostics)
        if (any(sizes(:s - 1)%group == sizes(s)%group)) call input%report(groups(i), 'target', &
          'target: ' // sizes(s)%path // ' is chosen already; allowed: once', diagnostics)
      else
        n = n + 1
        call read_number(input, groups(i), numbers(n), diagnostics)
        call refuse_twice(input, numbers(:n), 'number', diagnostics)
      end if
    end do
    call input%refuse(diagnostics, error)
  end subroutine read_choices

  pure logical function names_size(path)
    character(len=*), intent(in) :: path

    names_size = .false.
    if (len(path) > len(size_key)) names_size = index(path, coupling) == 1 .and. path(len(path) - len(size_key) + 1:) == size_key
  end function names_size

  subroutine read_size(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g   !! &design
    type(design_size_t), intent(inout) :: self
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=:), allocatable :: name
    type(string_t), allocatable :: known(:)
    integer :: i, k

    self%path = input%groups(g)%text('target')
    call refuse_numbers(input, g, diagnostics)
    name = self%path(len(coupling) + 1:len(self%path) - len(size_key))
    do i = 1, size(input%groups)
      if (input%groups(i)%kind == 'coupling' .and. input%groups(i)%name == name) self%group = i
    end do
    allocate (self%sizes(0))
    if (self%group == 0) then
      call input%report(g, 'target', 'target: there is no &coupling ' // quoted(name), diagnostics)
      return
    end if
    call list_sizes(input%groups(self%group), known)
    if (size(known) == 0) then
      call input%report(g, 'target', 'target: coupling ' // quoted(name) // ' has no catalogue; needed: its catalogue_file ' // &
                        'and size', diagnostics)
      return
    end if
    self%sizes = known
    if (.not. input%groups(g)%has_value('sizes')) return
    self%sizes = input%groups(g)%texts('sizes')
    do i = 1, size(self%sizes)
      if (any([(known(k)%text == self%sizes(i)%text, k=1, size(known))])) cycle
      call input%report(g, 'sizes', 'sizes: the catalogue has no size ' // quoted(self%sizes(i)%text), diagnostics)
    end do
  end subroutine read_size

  !> Refuses what only a number has: a size is one of a catalogue.
  subroutine refuse_numbers(input, g, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g   !! &design
    type(diagnostics_t), intent(inout) :: diagnostics
    character(len=*), parameter :: keys(*) = [character(len=6) :: 'low', 'values']   ! the others require low
    character(len=:), allocatable :: key
    real(wp), allocatable :: values(:)
    integer :: i

    do i = 1, size(keys)
      key = trim(keys(i))
      if (.not. input%groups(g)%has_value(key)) cycle
      allocate (values, source=input%groups(g)%numbers(key))
      call input%report(g, key, key // ' = ' // to_text(values(1)) // ': ' // quoted(input%groups(g)%text('target')) // &
                        ' is no number, but a size of a catalogue; allowed: sizes, or none of these keys', diagnostics)
      return
    end do
  end subroutine refuse_numbers

  subroutine read_number(input, g, self, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: g   !! &design
    type(design_number_t), intent(inout) :: self
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i
    real(wp) :: high, low, steps

    associate (group => input%groups(g))
      if (group%has_value('sizes')) then
        call input%report(g, 'sizes', "sizes belong to a target such as 'coupling.rubber.size'", diagnostics)
        return
      else if (.not. (group%has_value('values') .or. group%has_value('low'))) then
        call input%report(g, 'target', 'target = ' // quoted(group%text('target')) // ': no values; needed: low and high, ' // &
                          'or values', diagnostics)
        return
      end if
      if (group%has_value('values')) then
        self%values = group%numbers('values')
        low = minval(self%values)
        high = maxval(self%values)
      else
        low = group%number('low')
        high = group%number('high')
        if (group%has_value('step')) then
          steps = (high - low) / group%number('step') + 0.5_wp * rounding
          if (steps >= most_values) then
            call input%report(g, 'step', 'step = ' // to_text(group%number('step')) // ' gives more than ' // &
                              to_text(most_values) // ' values; allowed: a larger one', diagnostics)
            return
          end if
          allocate (self%values, source=[(low + i * group%number('step'), i=0, int(steps))])
          if (abs(steps - anint(steps)) < rounding) self%values(size(self%values)) = high
        end if
      end if
      self%is_continuous = .not. allocated(self%values)
      self%is_logarithmic = low > 0 .and. high >= wide * low
      call read_free_number(input, g, low, high, .not. self%is_continuous, self, diagnostics)
    end associate
  end subroutine read_number

  !> Whether a value may be chosen.
  pure logical function has_number(self, value)
    class(design_number_t), intent(in) :: self
    real(wp), intent(in) :: value

    if (self%is_continuous) then
      has_number = value >= self%low .and. value <= self%high
    else
      has_number = any(abs(self%values - value) <= rounding * abs(value))
    end if
  end function has_number

  !> Whether a size may be chosen.
  pure logical function has_size(self, name)
    class(design_size_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: i

    has_size = any([(self%sizes(i)%text == name, i=1, size(self%sizes))])
  end function has_size

  !> The value at a share of the way from low to high.
  pure real(wp) function at(self, share)
    class(design_number_t), intent(in) :: self
    real(wp), intent(in) :: share   !! 0 to 1

    if (share <= 0) then
      at = self%low
    else if (share >= 1) then
      at = self%high
    else if (self%is_logarithmic) then
      at = self%low * (self%high / self%low)**share
    else
      at = self%low + share * (self%high - self%low)
    end if
  end function at

  !> The inverse of `at`.
  pure real(wp) function share_of(self, value)
    class(design_number_t), intent(in) :: self
    real(wp), intent(in) :: value   !! low to high

    if (self%is_logarithmic) then
      share_of = log(value / self%low) / log(self%high / self%low)
    else
      share_of = (value - self%low) / (self%high - self%low)
    end if
  end function share_of

end module nocdyn_design_choices
