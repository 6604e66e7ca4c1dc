!> The keys of &run: the formulation and the method that a machine allows, as settings of the integrator and in summaries.
module nocdyn_run_settings
  use nocdyn_assembly, only: new_formulation
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_integration_settings, only: integration_settings_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_ordering, only: reverse_cuthill_mckee
  use nocdyn_pattern_entries, only: entries_in_rows, entries_t
  use nocdyn_stage_matrix, only: half_bandwidths
  use nocdyn_text, only: append, quoted, string_t, to_text
  implicit none (type, external)
  private

  public :: check_method, check_size, choose_settings, find_lossy_element, put_settings

  integer, parameter :: largest_matrix = 6000   ! rows; 0.3 GB each, and there are several

contains

  !> Refuses machines that are too large for the dense matrices, for `paper` and `multiplier`.
  subroutine check_size(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: formulation
    integer :: order   ! 2 rows for each body, or 3

    formulation = input%groups(input%position('run'))%text('formulation')
    order = merge(3, 2, formulation == 'paper') * machine%bodies
    if (formulation == 'reduced') return
    if (order <= largest_matrix) return
    call raise(error, exit_input, input%location(input%position('run'), 'formulation') // ': formulation = ' // &
               quoted(formulation) // ' needs dense matrices of ' // to_text(order) // &
               ' rows for this machine; at most ' // to_text(largest_matrix) // ' are allowed; ' // &
               'formulation = ' // quoted('reduced') // ' needs none')
  end subroutine check_size

  !> Refuses what a run or a sweep of the input refuses: a formulation or a method that is not for this machine.
  subroutine check_method(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(error_t), allocatable, intent(out) :: error
    class(formulation_t), allocatable :: formulation
    type(integration_settings_t) :: settings
    type(string_t), allocatable :: notes(:)

    call check_size(input, machine, error)
    if (allocated(error)) return
    associate (run => input%groups(input%position('run')))
      if (run%text('formulation') /= 'reduced' .and. run%text('method') /= 'taylor') return   ! its matrices need time
      call new_formulation(run%text('formulation'), machine, formulation, .false.)
    end associate
    call choose_settings(input, formulation, settings, notes, error)
  end subroutine check_method

  !> The settings of an integration, with the method of the input. Where the stage matrix would be too large, implicit methods are
  !> refused, and 'auto' becomes its explicit method, with a note. 'taylor' is refused where an element has no Taylor series.
  subroutine choose_settings(input, formulation, settings, notes, error)
    type(input_t), intent(in) :: input
    class(formulation_t), intent(in) :: formulation
    type(integration_settings_t), intent(out) :: settings
    type(string_t), allocatable, intent(out) :: notes(:)   !! for the user; empty if the method is the one of the input
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: obstacle, place
    type(entries_t) :: entries
    integer :: lower, rows, upper   ! half-bandwidths; stored rows of the factors, with the fill-in of pivoting

    allocate (notes(0))
    call find_lossy_element(input, formulation%machine, obstacle)
    if (obstacle /= '') call raise(error, exit_input, obstacle)
    if (allocated(error)) return
    call read_settings(input%groups(input%position('run')), settings)
    place = input%location(input%position('run'), 'method') // ': method = ' // quoted(trim(settings%method))
    if (settings%method == 'taylor') then
      call formulation%series_obstacle(obstacle)
      if (len(obstacle) > 0) call raise(error, exit_input, place // ' cannot be used: ' // obstacle)
    end if
    if (any(settings%method == [character(len=6) :: 'rk45', 'rk853', 'taylor']) .or. formulation%states <= largest_matrix) return
    entries = entries_in_rows(formulation%jacobian_pattern(), 1, formulation%states)
    call half_bandwidths(reverse_cuthill_mckee(formulation%states, entries%row, entries%column), entries, lower, upper)
    rows = min(2 * lower + upper + 1, formulation%states)
    if (real(rows, wp) * formulation%states <= real(largest_matrix, wp)**2) return
    obstacle = 'a matrix of ' // to_text(rows) // ' x ' // to_text(formulation%states) // ' entries for this machine, whose ' // &
               'couplings leave no narrower band; at most ' // to_text(largest_matrix) // ' x ' // to_text(largest_matrix) // &
               ' are allowed'
    if (settings%method == 'auto') then
      settings%method = 'rk853'
      call append(notes, "method = 'auto' takes explicit steps alone, those of 'rk853': implicit ones need " // obstacle)
    else
      call raise(error, exit_input, place // ' needs ' // obstacle // "; method = 'rk853' needs none")
    end if
  end subroutine choose_settings

  subroutine read_settings(run, settings)
    type(group_t), intent(in) :: run
    type(integration_settings_t), intent(inout) :: settings

    settings%method = run%text('method')
    settings%rtol = run%number('rtol')
    settings%atol = run%number('atol')
    settings%max_steps = run%whole_number('max_steps')
  end subroutine read_settings

  !> The message on an element whose relative damping has no frequency at which a viscous one stands for it over the time; '' if
  !> there is none.
  subroutine find_lossy_element(input, machine, text)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable, intent(out) :: text
    integer :: b, e, g

    text = ''
    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (.not. allocated(bank%loss_factor)) cycle
        e = findloc(bank%loss_factor > 0 .and. .not. bank%loss_damping > 0, .true., dim=1)
        if (e == 0) cycle
        do g = 1, size(input%groups)
          if (input%groups(g)%name /= bank%names(e)%text) cycle
          if (input%groups(g)%kind /= 'coupling' .and. input%groups(g)%kind /= 'shaft') cycle
          text = input%location(g) // ': its relative damping has no meaning over the time; required: damping_frequency ' // &
                 '[rad/s], at which a viscous damping stands for it'
          return
        end do
      end associate
    end do
  end subroutine find_lossy_element

  !> Writes the keys of &run that describe the integration, with their values.
  subroutine put_settings(json, run)
    type(json_t), intent(inout) :: json
    type(group_t), intent(in) :: run
    character(len=*), parameter :: keys(*) = &
      [character(len=11) :: 't_start', 't_end', 'method', 'rtol', 'atol', 'formulation', 'complement', 'max_steps']
    integer :: i, k

    call json%open('settings')
    do i = 1, size(keys)
      k = run%key_position(trim(keys(i)))
      if (allocated(run%values(k)%numbers)) then
        call json%put(trim(keys(i)), run%values(k)%numbers(1))
      else if (allocated(run%values(k)%whole_numbers)) then
        call json%put(trim(keys(i)), run%values(k)%whole_numbers(1))
      else
        call json%put(trim(keys(i)), run%values(k)%texts(1)%text)
      end if
    end do
    call json%close()
  end subroutine put_settings

end module nocdyn_run_settings
