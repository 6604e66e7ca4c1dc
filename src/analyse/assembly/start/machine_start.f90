!> The start speeds of a machine: those that the input gives, those that follow from them through couplings, gears and rows that
!> move, and 0 of all others.
module nocdyn_machine_start
  use nocdyn_element_groups, only: body_index_t
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_moving_start, only: fit_moving_rows
  use nocdyn_neighbour_speeds, only: neighbours_t, new_neighbours
  use nocdyn_shaft_assembly, only: shaft_set_t
  use nocdyn_start_speeds, only: fit_start_speeds
  use nocdyn_text, only: append, string_t
  use nocdyn_written_values, only: shared_unit
  implicit none (type, external)
  private

  public :: given_speeds, start_bodies

  !> What the speeds must fit.
  type :: fit_t
    integer, allocatable :: row_groups(:)    !! groups of the constraint rows
    logical :: may_project = .false.         !! whether speeds that do not fit the ratios are projected
    logical, allocatable :: is_given(:)      !! whether the input gives a speed, [bodies]
  end type fit_t

contains

  !> Completes and checks the start speeds. Speeds follow through couplings if the input does not ask for others than the given.
  subroutine start_bodies(input, row_groups, is_steady, body_index, shafts, machine, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: row_groups(:)   !! indices of the groups of the constraint rows
    logical, intent(in) :: is_steady       !! whether the machine is one in a steady state, with other ratios than at the start
    type(body_index_t), intent(in) :: body_index
    type(shaft_set_t), intent(in) :: shafts
    type(machine_t), intent(inout) :: machine   !! its coordinates are built
    type(error_t), allocatable, intent(out) :: error
    type(neighbours_t) :: neighbours
    type(fit_t) :: fit
    logical, dimension(machine%bodies) :: is_known, is_new
    integer :: bodies, pass

    bodies = machine%bodies - machine%nodes
    allocate (fit%row_groups, source=row_groups)
    fit%may_project = is_steady
    allocate (fit%is_given, source=given_speeds(input, machine%nodes))
    is_known = fit%is_given
    associate (run => input%groups(input%position('run')))
      if (run%text('start') /= 'given') then
        call fit_rows(input, fit, shafts, is_known, machine, error)
        return
      end if
    end associate
    neighbours = new_neighbours(input, body_index, machine)
    do pass = 1, machine%bodies
      call follow(neighbours, input, fit, shafts, is_known, machine, error)
      if (allocated(error)) return
      is_new = .not. is_known .and. abs(machine%start_speed(1, :)) > 0   ! they turn by gears and rows that move
      is_new(bodies + 1:) = .false.
      if (.not. any(is_new)) return
      is_known = is_known .or. is_new
    end do
  end subroutine start_bodies

  !> Takes speeds through couplings, then through rows, and once more if rows have replaced known speeds that were rounded.
  subroutine follow(neighbours, input, fit, shafts, is_known, machine, error)
    type(neighbours_t), intent(in) :: neighbours
    type(input_t), intent(in) :: input
    type(fit_t), intent(in) :: fit
    type(shaft_set_t), intent(in) :: shafts
    logical, intent(inout) :: is_known(:)   !! [bodies]
    type(machine_t), intent(inout) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: notes(:)
    real(wp) :: before(size(is_known))
    logical :: was_known(size(is_known))
    integer :: i, k, unit
    logical :: is_told   ! in a pass before

    unit = shared_unit(input, 'body', 'speed')
    was_known = is_known
    before = machine%start_speed(1, :)
    call neighbours%take(unit, machine, is_known, notes)
    call fit_rows(input, fit, shafts, is_known, machine, error)
    if (allocated(error)) return
    if (any(was_known .and. abs(machine%start_speed(1, :) - before) > 0) .and. any(is_known .neqv. was_known)) then
      is_known = was_known
      call neighbours%take(unit, machine, is_known, notes)
      call fit_rows(input, fit, shafts, is_known, machine, error)
      if (allocated(error)) return
    end if
    do i = 1, size(notes)
      is_told = .false.
      do k = 1, size(machine%start_notes)
        is_told = is_told .or. machine%start_notes(k)%text == notes(i)%text
      end do
      if (.not. is_told) call append(machine%start_notes, notes(i)%text)
    end do
  end subroutine follow

  !> Fits the start speeds to gears and to rows that move. Known speeds stay if rows that move let them, given ones in any case.
  !> A message begins with file, line and group.
  subroutine fit_rows(input, fit, shafts, is_known, machine, error)
    type(input_t), intent(in) :: input
    type(fit_t), intent(in) :: fit
    type(shaft_set_t), intent(in) :: shafts
    logical, intent(in) :: is_known(:)   !! [bodies]
    type(machine_t), intent(inout) :: machine
    type(error_t), allocatable, intent(out) :: error
    integer :: offending_row

    ! gears ask for speeds beside those that drives give
    if (allocated(machine%driven_speed)) machine%start_speed(1, :) = machine%start_speed(1, :) - machine%driven_speed
    associate (run => input%groups(input%position('run')))
      call fit_start_speeds(machine, is_known, run%text('start') == 'projected', shared_unit(input, 'body', 'speed'), &
                            offending_row, error)
      if (allocated(error) .and. fit%may_project) then   ! the speeds fit the ratios at the start, perhaps
        deallocate (error)
        call fit_start_speeds(machine, is_known, .true., 0, offending_row, error)
      end if
    end associate
    if (allocated(machine%driven_speed)) machine%start_speed(1, :) = machine%start_speed(1, :) + machine%driven_speed
    if (allocated(error)) then
      error%message = input%location(fit%row_groups(offending_row)) // ': ' // error%message
      return
    end if
    call shafts%place_nodes(machine)
    call fit_moving_rows(input, machine, is_known, error)
    if (.not. allocated(error) .or. all(is_known .eqv. fit%is_given)) return
    deallocate (error)
    call fit_moving_rows(input, machine, fit%is_given, error)
  end subroutine fit_rows

  !> Whether the input gives the start speed of a body, [bodies].
  function given_speeds(input, nodes) result(is_given)
    type(input_t), intent(in) :: input
    integer, intent(in) :: nodes   !! bodies that the input does not name
    logical, allocatable :: is_given(:)
    integer, allocatable :: bodies(:)
    integer :: b

    allocate (bodies, source=input%groups_named('body'))
    allocate (is_given(size(bodies) + nodes), source=.false.)
    do b = 1, size(bodies)
      is_given(b) = input%groups(bodies(b))%is_given('speed')
    end do
  end function given_speeds

end module nocdyn_machine_start
