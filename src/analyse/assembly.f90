!> From the input to the model: bodies, banks, constraints and coordinates.
module nocdyn_assembly
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_body_directory, only: bodies_of, directory_t, new_directory
  use nocdyn_complement, only: complement_natural, complement_negated, complement_scaled
  use nocdyn_constraint_analysis, only: analyse_constraints
  use nocdyn_constraint_assembly, only: assemble_constraints, constraint_groups
  use nocdyn_coordinates, only: new_coordinates
  use nocdyn_couplings, only: new_couplings
  use nocdyn_errors, only: error_t
  use nocdyn_excitations, only: new_excitations
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: group_t, input_t
  use nocdyn_kinds, only: wp
  use nocdyn_loads, only: new_loads
  use nocdyn_machine, only: machine_t
  use nocdyn_motors, only: new_motors
  use nocdyn_multiplier, only: new_multiplier
  use nocdyn_paper, only: new_paper
  use nocdyn_reduced, only: new_reduced
  use nocdyn_start_speeds, only: fit_start_speeds
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: assemble_machine, new_formulation

contains

  !> Builds the machine of a checked input; constraints that lock or that the start speeds violate are errors.
  subroutine assemble_machine(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(directory_t) :: directory

    machine%names = names_of(input, 'body')
    machine%bodies = size(machine%names)
    machine%inertia = lane_of(input, 'body', 'inertia')
    machine%start_angle = lane_of(input, 'body', 'angle')
    machine%start_speed = lane_of(input, 'body', 'speed')
    directory = new_directory(machine%names)
    call assemble_constraints(input, directory, machine%constraints, error)
    if (allocated(error)) return
    machine%banks = element_banks(input, directory)
    call machine%number_elements()
    call constrain(input, directory, machine, error)
  end subroutine assemble_machine

  !> Analyses the constraints, and chooses the coordinates and the speeds of the start.
  subroutine constrain(input, directory, machine, error)
    type(input_t), intent(in) :: input
    type(directory_t), intent(in) :: directory
    type(machine_t), intent(inout) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(group_t) :: run
    integer, allocatable :: wanted(:)
    integer :: culprit

    run = input%single('run')
    wanted = bodies_of(run, 'independent', directory)
    call analyse_constraints(machine%constraints, machine%names, wanted, machine%trains, machine%groups, culprit, error)
    if (.not. allocated(error)) then
      machine%coordinates = new_coordinates(machine%constraints, machine%trains, machine%groups, machine%inertia, wanted, &
                                            complement_choice(run%text('complement')))
      call fit_start_speeds(machine, run%text('start') == 'projected', culprit, error)
    end if
    if (allocated(error)) call tell_place(input, culprit, error)
  end subroutine constrain

  !> The system that an integrator solves, by the word of the input.
  subroutine new_formulation(word, machine, formulation, audited)
    character(len=*), intent(in) :: word
    type(machine_t), intent(in) :: machine
    class(formulation_t), allocatable, intent(out) :: formulation
    logical, intent(in), optional :: audited   !! whether the works of the elements are integrated; absent: they are
    logical :: has_works

    has_works = .true.
    if (present(audited)) has_works = audited
    select case (word)
    case ('reduced')
      allocate (formulation, source=new_reduced(machine, has_works))
    case ('paper')
      allocate (formulation, source=new_paper(machine, has_works))
    case ('multiplier')
      allocate (formulation, source=new_multiplier(machine, has_works))
    case default
      error stop 'nocdyn_assembly: the schema allows a formulation that is not there'
    end select
  end subroutine new_formulation

  pure integer function complement_choice(word)
    character(len=*), intent(in) :: word

    select case (word)
    case ('natural')
      complement_choice = complement_natural
    case ('scaled')
      complement_choice = complement_scaled
    case ('negated')
      complement_choice = complement_negated
    case default
      error stop 'nocdyn_assembly: the schema allows a complement that is not there'
    end select
  end function complement_choice

  !> Begins the message with file, line and group: of the constraint number `culprit`, of `independent` if that is 0.
  subroutine tell_place(input, culprit, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: culprit
    type(error_t), intent(inout) :: error
    integer, allocatable :: indices(:)

    if (culprit > 0) then
      allocate (indices, source=constraint_groups(input))
      error%message = input%place(indices(culprit)) // ': ' // error%message
    else
      allocate (indices, source=input%groups_named('run'))
      error%message = input%place(indices(1), 'independent') // ': independent ' // error%message
    end if
  end subroutine tell_place

  function names_of(input, kind) result(names)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind
    type(string_t), allocatable :: names(:)
    integer, allocatable :: indices(:)
    integer :: i

    allocate (indices, source=input%groups_named(kind))
    allocate (names(size(indices)))
    do i = 1, size(indices)
      names(i)%text = input%groups(indices(i))%name
    end do
  end function names_of

  !> One key of all groups of a kind as the parameters of a single lane, [1, groups]; 0 where it is unset.
  function lane_of(input, kind, key) result(values)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, key
    real(wp), allocatable :: values(:, :)
    integer, allocatable :: indices(:)
    integer :: i

    allocate (indices, source=input%groups_named(kind))
    allocate (values(1, size(indices)))
    do i = 1, size(indices)
      values(1, i) = input%groups(indices(i))%number(key, absent=0.0_wp)
    end do
  end function lane_of

  !> Value number `which` of a key that names bodies, of all groups of a kind.
  function ends_of(input, kind, key, which, directory) result(chosen)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: kind, key
    integer, intent(in) :: which
    type(directory_t), intent(in) :: directory
    integer, allocatable :: chosen(:)
    integer, allocatable :: bodies(:), indices(:)
    integer :: i

    allocate (indices, source=input%groups_named(kind))
    allocate (chosen(size(indices)))
    do i = 1, size(indices)
      bodies = bodies_of(input%groups(indices(i)), key, directory)
      chosen(i) = bodies(which)
    end do
  end function ends_of

  function element_banks(input, directory) result(banks)
    type(input_t), intent(in) :: input
    type(directory_t), intent(in) :: directory
    type(bank_slot_t), allocatable :: banks(:)

    ! `allocate (source=)`: gfortran 12 corrupts the heap on assignment to a polymorphic component of an array element
    allocate (banks(4))
    allocate (banks(1)%bank, source=new_couplings(names_of(input, 'coupling'), &
              ends_of(input, 'coupling', 'bodies', 1, directory), ends_of(input, 'coupling', 'bodies', 2, directory), &
              lane_of(input, 'coupling', 'stiffness'), lane_of(input, 'coupling', 'cubic_stiffness'), &
              lane_of(input, 'coupling', 'damping'), lane_of(input, 'coupling', 'rest_twist')))
    allocate (banks(2)%bank, source=new_motors(names_of(input, 'motor'), ends_of(input, 'motor', 'body', 1, directory), &
              lane_of(input, 'motor', 'a'), lane_of(input, 'motor', 'b'), lane_of(input, 'motor', 'c')))
    allocate (banks(3)%bank, source=new_loads(names_of(input, 'load'), ends_of(input, 'load', 'body', 1, directory), &
              lane_of(input, 'load', 'viscous')))
    allocate (banks(4)%bank, source=new_excitations(names_of(input, 'excitation'), &
              ends_of(input, 'excitation', 'body', 1, directory), lane_of(input, 'excitation', 'amplitude'), &
              lane_of(input, 'excitation', 'frequency'), lane_of(input, 'excitation', 'phase')))
  end function element_banks

end module nocdyn_assembly
