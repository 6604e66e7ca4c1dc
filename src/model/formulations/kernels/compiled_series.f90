!> The Taylor recurrence of a machine by a program that was written for its structure (`nocdyn_series_code`) and compiled.
module nocdyn_compiled_series
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_f_pointer, c_f_procpointer, c_funloc, c_funptr, c_int, &
    c_loc, c_long, c_null_ptr, c_ptr
  use nocdyn_compiled_code, only: loaded_code_t
  use nocdyn_curves, only: plain_curve_t
  use nocdyn_element_coordinates, only: element_coordinates_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_machine_state, only: machine_state_t
  use nocdyn_plain_steps, only: plain_steps_t
  use nocdyn_reduced_series, only: reduced_series_t
  use nocdyn_switch_code, only: followed_switches, switching_banks
  use nocdyn_vector_functions, only: cosines, log_cosh_of, sines
  implicit none (type, external)
  private

  !> Functions that the program calls.
  type, bind(c) :: function_table_t
    type(c_funptr) :: sines, cosines, log_cosh, logarithms, arctangents, powers
  end type function_table_t

  abstract interface
    !> Computes the coefficients 1 to P of the states y of all lanes.
    subroutine series_procedure(lanes, columns, numbers, space, functions, t, y) bind(c)
      import :: c_char, c_double, c_long, c_ptr, function_table_t
      integer(c_long), value, intent(in) :: lanes, columns
      type(c_ptr), intent(in) :: numbers(*)               !! arrays of the machine, in the order of `list_numbers`
      character(kind=c_char), intent(inout) :: space(*)   !! work space, of the length that `nocdyn_work` returns
      type(function_table_t), intent(in) :: functions
      real(c_double), intent(in) :: t(*)                  !! [s], [lanes]
      real(c_double), intent(inout) :: y(*)               !! [lanes, columns, 0:P]
    end subroutine series_procedure

    !> Takes plain steps.
    subroutine steps_procedure(steps, numbers, space, functions) bind(c)
      import :: c_char, c_ptr, function_table_t, plain_steps_t
      type(plain_steps_t), intent(in) :: steps
      type(c_ptr), intent(in) :: numbers(*)
      character(kind=c_char), intent(inout) :: space(*)
      type(function_table_t), intent(in) :: functions
    end subroutine steps_procedure

    !> Changes branches after plain steps.
    subroutine branches_procedure(steps, numbers) bind(c)
      import :: c_ptr, plain_steps_t
      type(plain_steps_t), intent(in) :: steps
      type(c_ptr), intent(in) :: numbers(*)
    end subroutine branches_procedure

    integer(c_long) function length_procedure() bind(c)
      import :: c_long
    end function length_procedure
  end interface

  !> Where the curves of a bank stand.
  type :: switch_curves_t
    type(plain_curve_t), allocatable :: curve(:, :)   !! [lanes, elements]
  end type switch_curves_t

  type, public :: compiled_series_t
    procedure(series_procedure), pointer, nopass, private :: run => null()
    procedure(steps_procedure), pointer, nopass, private :: run_steps => null()
    procedure(branches_procedure), pointer, nopass, private :: run_branches => null()
    integer, private :: order = 0                                  !! P
    integer, allocatable, private :: terms(:)                      !! of the elements, as in `reduced_series_t`
    logical :: follows_switches = .false.                          !! whether plain steps end where branches do
    integer, allocatable, private :: switching(:)                  !! banks with switches
    type(switch_curves_t), allocatable, private :: curves(:)       !! of these banks
    type(function_table_t), private :: functions
    character(kind=c_char), allocatable, private :: space(:)
    type(c_ptr), allocatable, private :: numbers(:)
  contains
    procedure :: attach, fits, expand, take_steps, change_branches
    procedure, private :: list_numbers, list_switches, list_curves
  end type compiled_series_t

contains

  !> Takes the procedures of a program that was written for a machine with the structure of `series`.
  subroutine attach(self, series, state, loaded)
    class(compiled_series_t), intent(inout) :: self
    type(reduced_series_t), intent(in) :: series
    type(machine_state_t), intent(in) :: state
    type(loaded_code_t), intent(in) :: loaded
    procedure(length_procedure), pointer :: length_of_work
    integer :: banks

    call c_f_procpointer(loaded%series, self%run)
    call c_f_procpointer(loaded%steps, self%run_steps)
    call c_f_procpointer(loaded%branches, self%run_branches)
    call c_f_procpointer(loaded%work, length_of_work)
    if (allocated(self%space)) deallocate (self%space, self%numbers)
    banks = size(series%banks%moved) + size(series%banks%timed)
    allocate (self%space(length_of_work()), source=char(0, c_char))
    self%switching = switching_banks(state)
    self%follows_switches = followed_switches(series, state) > 0
    if (allocated(self%curves)) deallocate (self%curves)
    allocate (self%curves(size(self%switching)))
    allocate (self%numbers(5 + 2 * banks + 2 * size(self%switching)))
    self%numbers(:) = c_null_ptr
    self%order = series%order
    self%terms = series%terms
    self%functions = function_table_t(c_funloc(call_sines), c_funloc(call_cosines), c_funloc(call_log_cosh), &
                                      c_funloc(call_logarithms), c_funloc(call_arctangents), c_funloc(call_powers))
  end subroutine attach

  !> Whether there is a program, and it is one for the present order and terms: these can grow from variant to variant.
  pure logical function fits(self, series)
    class(compiled_series_t), intent(in) :: self
    type(reduced_series_t), intent(in) :: series

    fits = self%order > 0 .and. self%order == series%order
    if (fits) fits = all(self%terms == series%terms)
  end function fits

  !> Computes the coefficients number 1 to P, as `expand` of the series does.
  subroutine expand(self, series, state, twist_at_origin, columns, t, y)
    class(compiled_series_t), intent(inout) :: self
    type(reduced_series_t), target, intent(in) :: series
    type(machine_state_t), target, intent(in) :: state
    real(wp), contiguous, target, intent(in) :: twist_at_origin(:, :)   !! [rad], [lanes, elements]
    integer, intent(in) :: columns                                      !! components of the state, and padding
    real(wp), intent(in) :: t(series%lanes)                             !! [s]
    real(wp), intent(inout) :: y(series%lanes, columns, 0:series%order) !! coefficients; number 0 is given

    call self%list_numbers(series, state, twist_at_origin)
    call self%run(int(series%lanes, c_long), int(columns, c_long), self%numbers, self%space, self%functions, t, y)
  end subroutine expand

  !> Takes plain steps.
  subroutine take_steps(self, series, state, twist_at_origin, switching, steps)
    class(compiled_series_t), intent(inout) :: self
    type(reduced_series_t), target, intent(in) :: series
    type(machine_state_t), target, intent(in) :: state
    real(wp), contiguous, target, intent(in) :: twist_at_origin(:, :)   !! [rad], [lanes, elements]
    type(element_coordinates_t), target, intent(in) :: switching        !! of the elements that switches look at
    type(plain_steps_t), intent(in) :: steps

    call self%list_numbers(series, state, twist_at_origin)
    if (self%follows_switches) call self%list_switches(state, switching)
    call self%run_steps(steps, self%numbers, self%space, self%functions)
  end subroutine take_steps

  !> Puts lanes on their next branches, after `take_steps`.
  subroutine change_branches(self, machine, state, steps)
    class(compiled_series_t), target, intent(inout) :: self
    type(machine_t), intent(in) :: machine
    type(machine_state_t), intent(inout) :: state   !! whose branches and constants change
    type(plain_steps_t), intent(in) :: steps
    integer(c_int), pointer, contiguous :: crossed(:)
    integer :: lane

    call c_f_pointer(steps%crossed, crossed, [steps%lanes])
    call self%list_curves(machine, crossed)
    call self%run_branches(steps, self%numbers)
    do lane = 1, size(crossed)
      if (crossed(lane) < 0) call state%take_constants(machine, int(-crossed(lane)), lane)
    end do
  end subroutine change_branches

  !> Where the curves of banks with switches stand, in the lanes where branches may change.
  subroutine list_curves(self, machine, crossed)
    class(compiled_series_t), target, intent(inout) :: self
    type(machine_t), intent(in) :: machine
    integer(c_int), intent(in) :: crossed(:)
    integer :: e, i, lane

    do i = 1, size(self%switching)
      associate (bank => machine%banks(self%switching(i))%bank, at => size(self%numbers) - size(self%switching) + i)
        if (.not. allocated(bank%curve)) cycle
        if (.not. allocated(self%curves(i)%curve)) then
          allocate (self%curves(i)%curve(size(bank%curve, 1), size(bank%curve, 2)))
        end if
        do e = 1, size(bank%curve, 2)
          do lane = 1, size(crossed)
            if (crossed(lane) > 0) call bank%curve(lane, e)%describe(self%curves(i)%curve(lane, e))
          end do
        end do
        self%numbers(at) = c_loc(self%curves(i)%curve)
      end associate
    end do
  end subroutine list_curves

  !> Where the numbers of the switches stand.
  subroutine list_switches(self, state, switching)
    class(compiled_series_t), intent(inout) :: self
    type(machine_state_t), target, intent(in) :: state
    type(element_coordinates_t), target, intent(in) :: switching
    integer :: i

    associate (at => size(self%numbers) - 2 * size(self%switching))
      self%numbers(at) = c_loc(switching%ratio)
      do i = 1, size(self%switching)
        call list_branches(state%banks(self%switching(i))%branch, self%numbers(at + i))
      end do
    end associate
  end subroutine list_switches

  !> Where branches stand.
  subroutine list_branches(branch, address)
    integer, contiguous, target, intent(in) :: branch(:, :)   !! [lanes, switches]
    type(c_ptr), intent(inout) :: address

    address = c_loc(branch)
  end subroutine list_branches

  !> Where the numbers of the machine stand.
  subroutine list_numbers(self, series, state, twist_at_origin)
    class(compiled_series_t), intent(inout) :: self
    type(reduced_series_t), target, intent(in) :: series
    type(machine_state_t), target, intent(in) :: state
    real(wp), contiguous, target, intent(in) :: twist_at_origin(:, :)   !! [rad], [lanes, elements]
    integer :: b

    self%numbers(1) = c_loc(series%law)
    self%numbers(2) = c_loc(series%twists%coefficient)
    self%numbers(3) = c_loc(series%accelerations%coefficient)
    self%numbers(4) = c_loc(twist_at_origin)
    do b = 1, size(series%banks%moved)
      call list(state%banks(series%banks%moved(b))%law%law%constant, state%banks(series%banks%moved(b))%law%law%stacked, b)
    end do
    do b = 1, size(series%banks%timed)
      call list(state%banks(series%banks%timed(b))%law%law%constant, state%banks(series%banks%timed(b))%law%law%stacked, &
                size(series%banks%moved) + b)
    end do

  contains

    subroutine list(constant, stacked, number)
      real(wp), contiguous, target, intent(in) :: constant(:, :), stacked(:)
      integer, intent(in) :: number

      self%numbers(3 + 2 * number) = c_loc(constant)
      self%numbers(4 + 2 * number) = c_loc(stacked)
    end subroutine list

  end subroutine list_numbers

  subroutine call_sines(n, x) bind(c)
    integer(c_int), intent(in) :: n
    real(c_double), intent(inout) :: x(n)

    call sines(n, x)
  end subroutine call_sines

  subroutine call_cosines(n, x) bind(c)
    integer(c_int), intent(in) :: n
    real(c_double), intent(inout) :: x(n)

    call cosines(n, x)
  end subroutine call_cosines

  subroutine call_log_cosh(n, x) bind(c)
    integer(c_int), intent(in) :: n
    real(c_double), intent(inout) :: x(n)

    x = log_cosh_of(x)
  end subroutine call_log_cosh

  subroutine call_logarithms(n, x) bind(c)
    integer(c_int), intent(in) :: n
    real(c_double), intent(inout) :: x(n)
    integer :: i

    !GCC$ novector
    do i = 1, n
      x(i) = log(x(i))
    end do
  end subroutine call_logarithms

  subroutine call_arctangents(n, x) bind(c)
    integer(c_int), intent(in) :: n
    real(c_double), intent(inout) :: x(n)
    integer :: i

    !GCC$ novector
    do i = 1, n
      x(i) = atan(x(i))
    end do
  end subroutine call_arctangents

  subroutine call_powers(n, x, exponent) bind(c)
    integer(c_int), intent(in) :: n
    real(c_double), intent(inout) :: x(n)
    real(c_double), intent(in) :: exponent(n)
    integer :: i

    !GCC$ novector
    do i = 1, n
      x(i) = x(i)**exponent(i)
    end do
  end subroutine call_powers

end module nocdyn_compiled_series
