!> The values of columns of the trajectory table, for all lanes of a block.
module nocdyn_recorded_columns
  use nocdyn_bank, only: role_coupling
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: reduced_t
  use nocdyn_shafts, only: shafts_t
  use nocdyn_trajectory_columns, only: column_angle, column_elastic, column_element, column_kinetic, column_member, &
    column_point_moment, column_point_stress, column_reaction, column_residual, column_speed, column_t, column_time, &
    column_work_in, column_work_out
  implicit none (type, external)
  private

  public :: new_recorded_columns, may_bend

  !> Columns one after the other whose indices are consecutive.
  type, extends(column_t) :: segment_t
    integer :: first = 1, last = 1     !! columns; `index` is that of the first
    logical :: has_new_values = .true. !! whether the segment before is of another bank or quantity
  end type segment_t

  !> Evaluates a copy of the formulation, because `observe` chooses branches: those of the integration must not change. After
  !> `copy_lane` it must not be moved in memory.
  type, public :: recorded_columns_t
    class(formulation_t), allocatable :: formulation
    type(segment_t), allocatable, private :: segments(:)
    type(lane_parameters_t), private :: parameters       !! of `formulation`; empty before `copy_lane`
    logical, private :: have_reactions = .false.
    logical, private :: have_energies = .false.          !! whether a column is an energy or a work
    logical, private :: have_elastic = .false., have_works = .false.   !! whether a column needs these
    real(wp), allocatable, private :: values(:)          !! of one quantity of a bank; work space
    real(wp), allocatable, private :: lambda(:)          !! multipliers of the constraint rows; work space
    integer, allocatable, private :: works_in(:)         !! indices of the works that count as put in, in the quadratures
    integer, allocatable, private :: works_out(:)        !! those of the others
    real(wp), private :: energies(column_kinetic:column_residual) = 0.0_wp   !! of one row [J]; work space
    real(wp), allocatable, private :: start_energy(:)    !! [J], [lanes]
  contains
    procedure :: copy_lane, start_lane, move_origin, observe, fill_row, kinetic_energy, find_pace
  end type recorded_columns_t

contains

  !> An evaluator of some columns.
  type(recorded_columns_t) function new_recorded_columns(formulation, columns) result(self)
    class(formulation_t), intent(in) :: formulation   !! with work integrals if a column needs them
    type(column_t), intent(in) :: columns(:)
    logical, allocatable :: is_source(:)   ! [quadratures]
    integer :: i

    if (any(columns%kind >= column_work_in) .and. .not. formulation%has_energy_balance) then
      error stop 'nocdyn_recorded_columns: work columns need a formulation with an energy balance'
    end if
    allocate (self%formulation, source=formulation)
    allocate (self%segments, source=segments_of(columns))
    self%have_reactions = any(columns%kind == column_reaction .or. columns%kind == column_member)
    self%have_energies = any(columns%kind >= column_kinetic)
    self%have_elastic = any(columns%kind == column_elastic .or. columns%kind == column_residual)
    self%have_works = any(columns%kind >= column_work_in)
    associate (banks => formulation%machine%banks)
      allocate (self%values(maxval([(banks(i)%bank%count, i=1, size(banks))])), source=0.0_wp)
      allocate (is_source, source=[(spread(banks(i)%bank%is_source(), 1, size(banks(i)%bank%with_work)), i=1, size(banks))])
    end associate
    allocate (self%works_in, source=pack([(i, i=1, size(is_source))], is_source))
    allocate (self%works_out, source=pack([(i, i=1, size(is_source))], .not. is_source))
    allocate (self%lambda(formulation%machine%constraints%rows()), source=0.0_wp)
    allocate (self%start_energy(formulation%lanes), source=0.0_wp)
  end function new_recorded_columns

  !> The columns as few segments.
  pure function segments_of(columns) result(segments)
    type(column_t), intent(in) :: columns(:)
    type(segment_t), allocatable :: segments(:)
    type(segment_t) :: all(0:size(columns))
    logical :: is_of_same
    integer :: i, n

    n = 0
    all(0)%kind = 0   ! of no column
    do i = 1, size(columns)
      is_of_same = columns(i)%kind == all(n)%kind .and. columns(i)%bank == all(n)%bank .and. &
                   columns(i)%quantity == all(n)%quantity
      if (is_of_same .and. columns(i)%index == all(n)%index + i - all(n)%first) then
        all(n)%last = i
        cycle
      end if
      n = n + 1
      all(n) = segment_t(columns(i)%kind, columns(i)%bank, columns(i)%quantity, columns(i)%index, i, i, .not. is_of_same)
    end do
    segments = all(1:n)
  end function segments_of

  !> Whether a column may bend more than the solution: torques, reactions and what follows from them, but not moments in
  !> proportion to twists and their rates.
  logical function may_bend(machine, column, varies)
    type(machine_t), intent(in) :: machine
    type(column_t), intent(in) :: column
    logical, intent(in) :: varies   !! whether cubic stiffnesses vary

    may_bend = any(column%kind == [column_element, column_reaction, column_member])
    if (column%kind /= column_element) return
    associate (bank => machine%banks(column%bank)%bank)
      if (bank%role == role_coupling .and. bank%has_paper_law .and. bank%has_polynomial_potential) then
        may_bend = varies .or. any(abs(machine%laws%cubic(:, bank%first:bank%last())) > 0)
      end if
    end associate
  end function may_bend

  !> How fast the columns of a lane oscillate where they were observed last, and the size of its moments.
  subroutine find_pace(self, lane, fastest, scale)
    class(recorded_columns_t), intent(in) :: self
    integer, intent(in) :: lane
    real(wp), intent(out) :: fastest   !! [rad/s]
    real(wp), intent(out) :: scale     !! [N m]

    fastest = self%formulation%fastest_wave(lane)
    associate (elements => self%formulation%machine%elements)
      scale = 0.0_wp
      if (elements%count > 0) scale = maxval(abs(elements%applied(lane, :))) + maxval(abs(elements%restoring(lane, :)))
    end associate
  end subroutine find_pace

  !> Copies the parameters of a lane from the formulation that is integrated.
  subroutine copy_lane(self, lane, parameters)
    class(recorded_columns_t), target, intent(inout) :: self
    integer, intent(in) :: lane
    type(lane_parameters_t), intent(in) :: parameters   !! of that formulation

    select type (formulation => self%formulation)
    class is (reduced_t)
      if (self%parameters%arrays == 0) call formulation%list_parameters(self%parameters)
    end select
    call self%parameters%copy_lane(lane, parameters, lane)
    call self%formulation%refresh_lane(lane)
  end subroutine copy_lane

  !> Stores the energy of a lane at its start, after `observe` there.
  subroutine start_lane(self, lane)
    class(recorded_columns_t), intent(inout) :: self
    integer, intent(in) :: lane

    if (self%have_elastic) self%start_energy(lane) = self%kinetic_energy(lane) + &
                                                     sum(self%formulation%machine%elements%stored(lane, :))
  end subroutine start_lane

  !> Takes a shift of the state of a lane.
  subroutine move_origin(self, lane, shift)
    class(recorded_columns_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: shift(:)   !! [states + quadratures]

    call self%formulation%move_origin(lane, shift)
  end subroutine move_origin

  !> Evaluates the machine of all lanes at a time and state.
  subroutine observe(self, t, y)
    class(recorded_columns_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: t(:)      !! [s], [lanes]
    real(wp), contiguous, intent(in) :: y(:, :)   !! [lanes, states + quadratures]

    call self%formulation%observe(t, y)
    if (self%have_elastic) call self%formulation%machine%evaluate_energies()
  end subroutine observe

  !> The values of a lane's columns, after `observe` at (t, y).
  subroutine fill_row(self, lane, t, y, row)
    class(recorded_columns_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! of the lane, [states + quadratures]
    real(wp), intent(inout) :: row(:)          !! [columns]
    integer :: k

    if (self%have_reactions) call self%formulation%reactions(lane, self%lambda)
    if (self%have_energies) call find_energies(self, lane, y)
    associate (machine => self%formulation%machine, members => self%formulation%machine%constraints%members)
      do k = 1, size(self%segments)
        associate (segment => self%segments(k), first => self%segments(k)%first, last => self%segments(k)%last, &
                   i => self%segments(k)%index, j => self%segments(k)%index + self%segments(k)%last - self%segments(k)%first)
          select case (segment%kind)
          case (column_time)
            row(first) = t
          case (column_angle)
            row(first:last) = self%formulation%phi(lane, i:j)
          case (column_speed)
            row(first:last) = self%formulation%omega(lane, i:j)
          case (column_element)
            if (segment%has_new_values) call observe_bank(machine, segment, lane, self%values)
            row(first:last) = self%values(i:j)
          case (column_reaction)
            row(first:last) = self%lambda(i:j)
          case (column_member)
            row(first:last) = members%factor(lane, i:j) * self%lambda(members%row(i:j))
          case (column_point_moment, column_point_stress)
            call fill_points(machine, segment, lane, row(first:last))
          case (column_kinetic:column_residual)
            row(first) = self%energies(segment%kind)
          case default
            error stop 'nocdyn_recorded_columns: there is no such column'
          end select
        end associate
      end do
    end associate
  end subroutine fill_row

  !> The values of one quantity of a bank.
  subroutine observe_bank(machine, segment, lane, values)
    type(machine_t), intent(in) :: machine
    type(segment_t), intent(in) :: segment
    integer, intent(in) :: lane
    real(wp), contiguous, intent(inout) :: values(:)   !! [elements of the bank at least]

    associate (bank => machine%banks(segment%bank)%bank)
      call bank%observe(machine%elements, segment%quantity, lane, values(:bank%count))
    end associate
  end subroutine observe_bank

  !> The moments or stresses at points of a shaft.
  subroutine fill_points(machine, segment, lane, values)
    type(machine_t), intent(in) :: machine
    type(segment_t), intent(in) :: segment
    integer, intent(in) :: lane
    real(wp), intent(inout) :: values(:)   !! [N m] or [Pa]
    integer :: p

    select type (bank => machine%banks(segment%bank)%bank)
    type is (shafts_t)
      do p = 1, size(values)
        values(p) = bank%moment_at(machine%elements, segment%quantity, segment%index + p - 1, lane)
      end do
      if (segment%kind == column_point_stress) then
        associate (moduli => bank%parameters(bank%number_of('shaft_modulus'))%value, &
                   first => bank%shafts(segment%quantity)%first_point + segment%index - 1)
          values(:) = values / moduli(lane, first:first + size(values) - 1)
        end associate
      end if
    class default
      error stop 'nocdyn_recorded_columns: the points are of a shaft'
    end select
  end subroutine fill_points

  !> Energies and works of one lane, one number for each kind of column.
  subroutine find_energies(self, lane, y)
    type(recorded_columns_t), intent(inout) :: self
    integer, intent(in) :: lane
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]

    associate (energies => self%energies)
      energies(column_kinetic) = self%kinetic_energy(lane)
      if (self%have_elastic) energies(column_elastic) = sum(self%formulation%machine%elements%stored(lane, :))
      if (.not. self%have_works) return
      energies(column_work_in) = work(self%works_in, self%formulation%states, y)
      energies(column_work_out) = work(self%works_out, self%formulation%states, y)
      energies(column_residual) = (energies(column_kinetic) + energies(column_elastic) - self%start_energy(lane)) &
                                  - (energies(column_work_in) + energies(column_work_out))
      energies(column_work_out) = 0.0_wp - energies(column_work_out)   ! not -0 without any work
    end associate
  end subroutine find_energies

  !> The kinetic energy of a lane after `observe` [J].
  pure real(wp) function kinetic_energy(self, lane)
    class(recorded_columns_t), intent(in) :: self
    integer, intent(in) :: lane

    kinetic_energy = self%formulation%machine%kinetic_energy(lane, self%formulation%omega(lane, 1:))
  end function kinetic_energy

  !> The sum of some work integrals of a lane, positive into the machine [J].
  pure real(wp) function work(works, states, y)
    integer, intent(in) :: works(:)   !! indices in the quadratures
    integer, intent(in) :: states     !! their number, before the quadratures
    real(wp), contiguous, intent(in) :: y(:)
    integer :: i

    work = 0.0_wp
    do i = 1, size(works)
      work = work + y(states + works(i))
    end do
  end function work

end module nocdyn_recorded_columns
