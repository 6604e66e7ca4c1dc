!> Limits on the size of dense matrices; the method that a machine can be integrated with.
module nocdyn_size_limits
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_in_rows, entries_t
  use nocdyn_stage_matrix, only: half_bandwidths
  use nocdyn_text, only: append, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: check_size, check_dense_size, choose_method

  integer, parameter :: largest_matrix = 6000   ! rows; 0.3 GB each, and there are several
  integer, parameter :: largest_problem = 3000  ! states of an eigenvalue problem; it takes some minutes

contains

  !> Refuses machines that are too large for the dense matrices of the formulations `paper` and `multiplier`.
  subroutine check_size(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run
    integer, allocatable :: indices(:)
    integer :: order

    run = input%single('run')
    select case (run%text('formulation'))
    case ('paper')
      order = 3 * machine%bodies
    case ('multiplier')
      order = 2 * machine%bodies
    case default
      order = 0
    end select
    if (order <= largest_matrix) return
    allocate (indices, source=input%groups_named('run'))
    call raise(error, exit_input, input%location(indices(1), 'formulation') // ': formulation = ' // &
               quoted(run%text('formulation')) // ' needs dense matrices of ' // to_text(order) // &
               ' rows for this machine; at most ' // to_text(largest_matrix) // ' are allowed; ' // &
               'formulation = ' // quoted('reduced') // ' needs none')
  end subroutine check_size

  !> Refuses machines with too many states for a dense eigenvalue problem.
  subroutine check_dense_size(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error

    if (2 * machine%coordinates%freedoms <= largest_problem) return
    call raise(error, exit_input, input%file // ': the modes of this machine are those of a dense matrix of ' // &
               to_text(2 * machine%coordinates%freedoms) // ' states; at most ' // to_text(largest_problem) // ' are allowed')
  end subroutine check_dense_size

  !> The method to integrate with: that of the input. Where the stage matrix would be too large, implicit methods are refused,
  !> and 'auto' becomes its explicit method, with a note. 'taylor' is refused where an element has no Taylor series.
  subroutine choose_method(input, formulation, method, notes, error)
    type(input_t), intent(in) :: input
    class(formulation_t), intent(in) :: formulation
    character(len=:), allocatable, intent(out) :: method   !! the one of the input, or the explicit part of 'auto'
    type(string_t), allocatable, intent(out) :: notes(:)   !! for the user; empty if the method is that of the input
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run
    integer, allocatable :: indices(:)
    character(len=:), allocatable :: need
    integer :: rows

    allocate (notes(0))
    run = input%single('run')
    method = run%text('method')
    if (method == 'taylor') call refuse_missing_series(input, formulation, error)
    if (allocated(error)) return
    if (any(method == [character(len=6) :: 'rk45', 'rk853', 'taylor']) .or. formulation%states <= largest_matrix) return
    rows = stage_matrix_rows(formulation)
    if (real(rows, wp) * formulation%states <= real(largest_matrix, wp)**2) return
    need = 'a matrix of ' // to_text(rows) // ' x ' // to_text(formulation%states) // &
           ' entries for this machine, whose couplings leave no narrower band; at most ' // to_text(largest_matrix) // ' x ' // &
           to_text(largest_matrix) // ' are allowed'
    if (method == 'auto') then
      method = 'rk853'
      call append(notes, 'method = ' // quoted('auto') // ' takes explicit steps alone, those of ' // quoted(method) // &
                         ': implicit ones need ' // need)
    else
      allocate (indices, source=input%groups_named('run'))
      call raise(error, exit_input, input%location(indices(1), &
                                                   'method') // ': method = ' // quoted(method) // ' needs ' // need // &
                 '; method = ' // quoted('rk853') // ' needs none')
    end if
  end subroutine choose_method

  !> Refuses the method 'taylor' for formulations without Taylor series.
  subroutine refuse_missing_series(input, formulation, error)
    type(input_t), intent(in) :: input
    class(formulation_t), intent(in) :: formulation
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: indices(:)
    character(len=:), allocatable :: obstacle

    call formulation%series_obstacle(obstacle)
    if (len(obstacle) == 0) return
    allocate (indices, source=input%groups_named('run'))
    call raise(error, exit_input, input%location(indices(1), 'method') // ': method = ' // quoted('taylor') // &
               ' cannot be used: ' // obstacle)
  end subroutine refuse_missing_series

  !> Stored rows of the factors of a stage matrix: its band with the fill-in of pivoting, at most all rows.
  function stage_matrix_rows(formulation) result(rows)
    class(formulation_t), intent(in) :: formulation
    integer :: rows
    type(entries_t) :: entries
    integer :: lower, upper

    entries = entries_in_rows(formulation%jacobian_pattern(), 1, formulation%states)
    call half_bandwidths(reverse_cuthill_mckee(formulation%states, entries%row, entries%column), entries, lower, upper)
    rows = min(2 * lower + upper + 1, formulation%states)
  end function stage_matrix_rows

end module nocdyn_size_limits
