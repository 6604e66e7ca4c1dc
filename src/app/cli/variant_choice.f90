!> A variant of a sweep as an input: `--variant DIR:NUMBER` becomes settings of the numbers that the variant has.
module nocdyn_variant_choice
  use nocdyn_arguments, only: arguments_t
  use nocdyn_case_choice, only: choose_case, wanted_case
  use nocdyn_commands, only: command_t
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_input, only: input_t
  use nocdyn_input_reader, only: read_input
  use nocdyn_input_text, only: input_text
  use nocdyn_kinds, only: wp
  use nocdyn_literals, only: literal_ok, read_integer
  use nocdyn_result_folders, only: normalised_path
  use nocdyn_sweep_differences, only: input_difference
  use nocdyn_sweep_header, only: sweep_header_t, sweep_netcdf_name
  use nocdyn_sweep_journal, only: journal_names, read_journal_header
  use nocdyn_sweep_plan, only: has_sweep, make_plan, remove_sweep, sweep_plan_t
  use nocdyn_targets, only: target_path
  use nocdyn_text, only: append, shown_path, string_t, to_text
  use nocdyn_text_file, only: largest_input, read_text_file
  implicit none (type, external)
  private

  public :: choose_variant, leave_sweep

  character(len=*), parameter :: input_file = 'input.nml', summary_file = 'summary.json'   ! of the results of a sweep

contains

  !> Replaces --variant by the input of the sweep, the numbers of the variant as settings before those of --set, and a folder.
  subroutine choose_variant(command, arguments, error)
    type(command_t), intent(in) :: command
    type(arguments_t), intent(inout) :: arguments
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: checksum, folder, recorded
    type(string_t), allocatable :: settings(:)
    type(input_t) :: input
    type(sweep_plan_t) :: plan
    integer :: i, variant

    if (.not. arguments%is_given('--variant')) return
    call read_choice(arguments%value('--variant'), folder, variant, error)
    if (allocated(error)) return
    call find_recorded_input(folder, size(arguments%operands) > 0, recorded, checksum, error)
    if (allocated(error)) return
    if (size(arguments%operands) == 0) call append(arguments%operands, folder // '/' // input_file)
    call read_sweep(arguments, input, error)
    if (.not. allocated(error)) call refuse_other_input(folder, recorded, input, error)
    if (.not. allocated(error)) call make_plan(input, plan, error)
    if (.not. allocated(error)) call refuse_other_list(folder, checksum, plan, error)
    if (allocated(error)) return
    if (variant < 1 .or. variant > plan%design%variants) then
      call raise(error, exit_input, '--variant ' // arguments%value('--variant') // ': the sweep has no variant ' // &
                 to_text(variant) // '; allowed: 1 to ' // to_text(plan%design%variants))
      return
    end if
    call list_settings(plan, variant, settings)
    do i = 1, size(arguments%overrides)
      call append(settings, arguments%overrides(i)%text)
    end do
    call move_alloc(settings, arguments%overrides)
    if (arguments%is_given('--out') .or. .not. command%takes('--quiet')) return   ! those without --quiet write with --out only
    call append(arguments%names, '--out')
    call append(arguments%values, folder // '/variant-' // to_text(variant))
  end subroutine choose_variant

  !> Leaves the groups of the sweep out of what is read of a file, if it is to be a variant.
  pure subroutine leave_sweep(arguments, machine, load_cases)
    type(arguments_t), intent(in) :: arguments
    type(input_t), intent(inout) :: machine
    type(input_t), intent(inout) :: load_cases(:)
    integer :: c

    if (.not. arguments%is_given('--variant')) return
    call remove_sweep(machine)
    do c = 1, size(load_cases)
      call remove_sweep(load_cases(c))
    end do
  end subroutine leave_sweep

  !> Takes DIR:NUMBER apart.
  subroutine read_choice(text, folder, variant, error)
    character(len=*), intent(in) :: text
    character(len=:), allocatable, intent(out) :: folder
    integer, intent(out) :: variant
    type(error_t), allocatable, intent(out) :: error
    integer :: colon, status

    colon = index(text, ':', back=.true.)
    status = literal_ok - 1
    variant = 0
    if (colon > 1) call read_integer(text(colon + 1:), variant, status)
    if (status == literal_ok) then
      folder = normalised_path(text(:colon - 1))
    else
      call raise(error, exit_input, '--variant ' // text // &
                 ': allowed: DIR:NUMBER, the folder of a sweep and the number of a variant, from 1 on')
    end if
  end subroutine read_choice

  !> The text of the input that a sweep had, by its results or by the journal of an unfinished sweep.
  subroutine find_recorded_input(folder, has_file, recorded, checksum, error)
    character(len=*), intent(in) :: folder
    logical, intent(in) :: has_file   !! the command line names the input file too
    character(len=:), allocatable, intent(out) :: recorded
    character(len=:), allocatable, intent(out) :: checksum   !! of a journal, of the file of its list; not allocated: of results
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    type(sweep_header_t) :: header
    logical :: is_there

    allocate (names, source=journal_names(folder))
    inquire (file=folder // '/' // sweep_netcdf_name, exist=is_there)
    if (is_there) inquire (file=folder // '/' // input_file, exist=is_there)
    if (size(names) > 0) then   ! of a sweep that is newer than the results beside it
      call read_journal_header(folder, names(1)%text, header, error)
      if (allocated(error)) return
      recorded = header%input_text
      checksum = header%list_checksum
      if (.not. has_file) call raise(error, exit_input, shown_path(folder) // ': this sweep is not finished; needed: its ' // &
        'input file beside --variant, ' // shown_path(header%input_file))
    else if (is_there) then
      call read_text_file(folder // '/' // input_file, recorded, error, largest_input)
    else
      call raise(error, exit_file, shown_path(folder) // ' holds no sweep: neither ' // sweep_netcdf_name // ' with ' // &
                 input_file // ' nor a journal; needed: the folder that nocdyn sweep has written to')
    end if
  end subroutine find_recorded_input

  !> Reads the input with the groups of the sweep, without the settings of the command line.
  subroutine read_sweep(arguments, input, error)
    type(arguments_t), intent(in) :: arguments   !! with one operand
    type(input_t), intent(out) :: input
    type(error_t), allocatable, intent(out) :: error
    type(input_t), allocatable :: load_cases(:)
    type(string_t) :: none(0)
    integer :: chosen

    call read_input(arguments%operands(1)%text, none, input, error, load_cases=load_cases, only_case=wanted_case(arguments))
    if (.not. allocated(error)) call choose_case(arguments, input, chosen, error)
    if (allocated(error)) return
    if (chosen > 0) input = load_cases(chosen)
    if (.not. has_sweep(input)) call raise(error, exit_input, input%shown_file() // &
                                           ': there is no &sweep in it, of which --variant would be one')
  end subroutine read_sweep

  !> Refuses an input of another machine or sweep.
  subroutine refuse_other_input(folder, recorded, input, error)
    character(len=*), intent(in) :: folder, recorded
    type(input_t), intent(in) :: input
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: difference

    difference = input_difference(recorded, input_text(input))
    if (difference == '') return
    call raise(error, exit_input, input%shown_file() // ': ' // shown_path(folder) // &
               ' holds a sweep of another input: ' // difference)
  end subroutine refuse_other_input

  !> Refuses a list of variants that has changed since the sweep, which its journal or summary tells.
  subroutine refuse_other_list(folder, checksum, plan, error)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable, intent(in) :: checksum   !! as of `find_recorded_input`
    type(sweep_plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: summary
    logical :: is_same

    if (plan%list_checksum == '') return
    if (allocated(checksum)) then
      is_same = checksum == plan%list_checksum
    else
      call read_text_file(folder // '/' // summary_file, summary, error, largest_input)
      if (allocated(error)) return
      is_same = index(summary, '"list_checksum": "' // plan%list_checksum // '"') > 0
    end if
    if (.not. is_same) call raise(error, exit_input, plan%input%shown_file() // ': the list of variants is not the ' // &
                                  'one of the sweep in ' // shown_path(folder))
  end subroutine refuse_other_list

  !> PATH=VALUE of all numbers that a variant sets, with the digits that read back as the same bits.
  subroutine list_settings(plan, variant, settings)
    type(sweep_plan_t), intent(in) :: plan
    integer, intent(in) :: variant
    type(string_t), allocatable, intent(out) :: settings(:)
    real(wp) :: values(size(plan%numbers%targets)), x(size(plan%numbers%list))
    integer :: i

    call plan%values(variant, x)
    call plan%numbers%target_values(x, values)
    allocate (settings(0))
    do i = 1, size(values)
      associate (target => plan%numbers%targets(i))
        if (target%is_integer) then
          call append(settings, target_path(plan%input, target) // '=' // to_text(nint(values(i))))
        else
          call append(settings, target_path(plan%input, target) // '=' // to_text(values(i)))
        end if
      end associate
    end do
  end subroutine list_settings

end module nocdyn_variant_choice
