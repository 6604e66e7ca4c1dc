!> From the input to the model: bodies, banks, constraints and coordinates.
module nocdyn_assembly
  use nocdyn_bank, only: bank_slot_t
  use nocdyn_complement, only: complement_natural, complement_negated, complement_scaled
  use nocdyn_constraint_analysis, only: analyse_constraints
  use nocdyn_constraints, only: constraints_t, new_constraints
  use nocdyn_coordinates, only: new_coordinates
  use nocdyn_couplings, only: new_couplings
  use nocdyn_errors, only: error_t, exit_input, raise
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
  use nocdyn_schema_rules, only: ground
  use nocdyn_text, only: quoted, rounded_text, string_t, to_text
  use nocdyn_text_order, only: find_order, first_position
  implicit none (type, external)
  private

  public :: assemble_machine, new_formulation

  !> Start speeds break a gear when the sum of the row exceeds this times the sum of its absolute terms.
  real(wp), parameter :: speed_tolerance = 1.0e-9_wp

  !> Finds bodies by name.
  type :: directory_t
    type(string_t), allocatable :: names(:)
    integer, allocatable :: order(:)
  contains
    procedure :: body
  end type directory_t

contains

  !> Builds the machine of a checked input; gears that lock or that the start speeds break are errors.
  subroutine assemble_machine(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error
    type(directory_t) :: directory
    type(group_t) :: run
    integer, allocatable :: wanted(:)
    integer :: culprit

    machine%names = names_of(input, 'body')
    machine%bodies = size(machine%names)
    machine%inertia = lane_of(input, 'body', 'inertia')
    machine%start_angle = lane_of(input, 'body', 'angle')
    machine%start_speed = lane_of(input, 'body', 'speed')
    directory%names = machine%names
    allocate (directory%order(machine%bodies))
    call find_order(directory%names, directory%order)
    machine%constraints = gear_constraints(input, directory)
    machine%banks = element_banks(input, directory)
    call machine%number_elements()

    run = input%single('run')
    wanted = bodies_of(run, 'independent', directory)
    call analyse_constraints(machine%constraints, machine%names, wanted, machine%trains, machine%groups, culprit, error)
    if (.not. allocated(error)) call refuse_start_speeds(machine, culprit, error)
    if (allocated(error)) then
      call tell_place(input, culprit, error)
      return
    end if
    machine%coordinates = new_coordinates(machine%constraints, machine%trains, machine%groups, machine%inertia, wanted, &
                                          complement_choice(run%text('complement')))
  end subroutine assemble_machine

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

  !> Begins the message with file, line and group: of the gear number `culprit`, of `independent` if that is 0.
  subroutine tell_place(input, culprit, error)
    type(input_t), intent(in) :: input
    integer, intent(in) :: culprit
    type(error_t), intent(inout) :: error
    integer, allocatable :: indices(:)

    if (culprit > 0) then
      allocate (indices, source=input%groups_named('gear'))
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

  !> Body by name, 0 for the ground.
  pure integer function body(self, name)
    class(directory_t), intent(in) :: self
    character(len=*), intent(in) :: name

    body = 0
    if (name /= ground) body = first_position(name, self%names, self%order)
  end function body

  !> The bodies that one group names under a key, in the order of its values.
  function bodies_of(group, key, directory) result(bodies)
    type(group_t), intent(in) :: group
    character(len=*), intent(in) :: key
    type(directory_t), intent(in) :: directory
    integer, allocatable :: bodies(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names, source=group%texts(key))
    allocate (bodies(size(names)))
    do i = 1, size(names)
      bodies(i) = directory%body(names(i)%text)
    end do
  end function bodies_of

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

  !> Eq. (8) for every gear: R1 omega_1 + R2 omega_2 = 0, a minus for an internal gear.
  !>
  !> With radii the multiplier is the tooth force [N]; with teeth the row is scaled so that it is the torque on the
  !> first body [N m].
  function gear_constraints(input, directory) result(constraints)
    type(input_t), intent(in) :: input
    type(directory_t), intent(in) :: directory
    type(constraints_t) :: constraints
    type(string_t), allocatable :: units(:)
    integer, allocatable :: indices(:), wheels(:, :)
    real(wp), allocatable :: coefficients(:, :)
    integer :: i

    allocate (indices, source=input%groups_named('gear'))
    allocate (units(size(indices)), coefficients(2, size(indices)), wheels(2, size(indices)))
    wheels(1, :) = ends_of(input, 'gear', 'bodies', 1, directory)
    wheels(2, :) = ends_of(input, 'gear', 'bodies', 2, directory)
    do i = 1, size(indices)
      associate (gear => input%groups(indices(i)))
        if (gear%has_value('radii')) then
          coefficients(:, i) = gear%numbers('radii')
          units(i)%text = 'N'
        else
          coefficients(:, i) = real(gear%whole_numbers('teeth'), wp)
          coefficients(:, i) = coefficients(:, i) / coefficients(1, i)
          units(i)%text = 'N m'
        end if
        if (gear%flag('internal')) coefficients(2, i) = -coefficients(2, i)
      end associate
    end do
    constraints = new_constraints(size(directory%names), names_of(input, 'gear'), units, [(2 * i - 1, i=1, size(indices) + 1)], &
                                  reshape(wheels, [size(wheels)]), reshape(coefficients, [1, size(coefficients)]))
  end function gear_constraints

  !> Error for the first gear whose wheels do not start with fitting speeds.
  subroutine refuse_start_speeds(machine, culprit, error)
    type(machine_t), intent(in) :: machine
    integer, intent(out) :: culprit
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: residual, scale
    integer :: row

    culprit = 0
    do row = 1, machine%constraints%rows()
      call machine%constraints%residual(1, row, machine%start_speed(1, :), residual, scale)
      if (abs(residual) <= speed_tolerance * scale) cycle
      culprit = row
      call raise(error, exit_input, 'the start speeds break this gear: ' // row_text(machine, row) // ' = ' // &
                 rounded_text(residual, 6) // ', which must be 0' // fitting_speed(machine, row))
      return
    end do
  end subroutine refuse_start_speeds

  !> For a row of two bodies: the speed of the second that fits that of the first.
  function fitting_speed(machine, row) result(text)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: row
    character(len=:), allocatable :: text
    real(wp) :: speed
    integer :: first

    text = ''
    associate (rows => machine%constraints)
      first = rows%first(row)
      if (rows%first(row + 1) - first /= 2) return
      speed = -rows%coefficient(1, first) * machine%start_speed(1, rows%body(first)) / rows%coefficient(1, first + 1)
      text = '; ' // quoted(machine%names(rows%body(first + 1))%text) // ' fits with speed = ' // to_text(speed)
    end associate
  end function fitting_speed

  !> The left-hand side of a row with the start speeds in it, e.g. "2 * 1 ('pinion') + 3 * 0 ('machine')".
  function row_text(machine, row) result(text)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: row
    character(len=:), allocatable :: text
    integer :: entry

    text = ''
    associate (rows => machine%constraints)
      do entry = rows%first(row), rows%first(row + 1) - 1
        if (entry > rows%first(row)) text = text // ' + '
        text = text // to_text(rows%coefficient(1, entry)) // ' * ' // &
               to_text(machine%start_speed(1, rows%body(entry))) // ' rad/s (' // &
               quoted(machine%names(rows%body(entry))%text) // ')'
      end do
    end associate
  end function row_text

end module nocdyn_assembly
