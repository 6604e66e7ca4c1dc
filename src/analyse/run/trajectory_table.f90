!> The rows of trajectory.csv: the values of all columns of a machine at a time and state.
module nocdyn_trajectory_table
  use nocdyn_bank, only: quantity_t
  use nocdyn_constraints, only: constraints_t
  use nocdyn_energy_balance, only: energy_balance_t, work_element_names
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: string_t
  use nocdyn_trajectory_columns, only: column_t, list_columns
  implicit none (type, external)
  private

  public :: new_trajectory_table

  type :: bank_columns_t
    type(quantity_t), allocatable :: quantities(:)
  end type bank_columns_t

  !> Evaluates one lane; it keeps a machine of its own, so that a running integration is not disturbed.
  type, public :: trajectory_table_t
    type(string_t), allocatable :: labels(:)
    class(formulation_t), allocatable :: formulation
    type(bank_columns_t), allocatable, private :: columns(:)   !! of each bank
    real(wp), private :: t(1) = 0.0_wp
    real(wp), allocatable, private :: y(:, :)      !! [1, states + quadratures]
    real(wp), allocatable, private :: values(:)    !! of one quantity of a bank, work space
    real(wp), allocatable, private :: lambda(:)    !! multipliers, work space, [rows]
    logical, allocatable, private :: is_source(:)  !! whether a work counts as put in, [quadratures]
    real(wp), private :: start_energy = 0.0_wp
    real(wp), private :: start_kinetic = 0.0_wp
    real(wp), allocatable, private :: start_stored(:)   !! of the elastic elements
  contains
    procedure :: fill
    procedure :: find_energy_balance
    procedure, private :: fill_energies
  end type trajectory_table_t

contains

  !> A table for the columns of a machine; the energies of the start are taken at `t_start` [s].
  function new_trajectory_table(formulation, t_start) result(table)
    class(formulation_t), intent(in) :: formulation   !! of one lane, audited
    real(wp), intent(in) :: t_start
    type(trajectory_table_t) :: table
    type(column_t), allocatable :: columns(:)
    integer :: i

    if (.not. formulation%has_energy_balance) error stop 'nocdyn_trajectory_table: the works are among the columns'
    allocate (table%formulation, source=formulation)
    associate (banks => formulation%machine%banks)
      allocate (table%columns(size(banks)))
      do i = 1, size(banks)
        table%columns(i)%quantities = banks(i)%bank%quantities()
      end do
      allocate (table%values(maxval([(size(banks(i)%bank%to), i=1, size(banks))])))
      table%is_source = [(spread(banks(i)%bank%is_source(), 1, size(banks(i)%bank%with_work)), i=1, size(banks))]
    end associate
    allocate (table%lambda(formulation%machine%constraints%rows()))
    call list_columns(formulation%machine, columns, table%labels)
    table%y = formulation%start()
    call table%formulation%observe([t_start], table%y)
    table%start_kinetic = kinetic_energy(table%formulation)
    table%start_energy = table%start_kinetic + table%formulation%machine%stored_energy(1)
    allocate (table%start_stored, source=stored_energies(table%formulation%machine))
  end function new_trajectory_table

  !> The row of the table at time t and state y.
  subroutine fill(self, t, y, row)
    class(trajectory_table_t), intent(inout) :: self
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp), intent(out) :: row(:)            !! [labels]
    integer :: e, i, next, q

    self%t(1) = t
    self%y(1, :) = y
    call self%formulation%observe(self%t, self%y)
    associate (machine => self%formulation%machine)
      row(1) = t
      row(2:1 + machine%bodies) = self%formulation%phi(1, 1:)
      row(2 + machine%bodies:1 + 2 * machine%bodies) = self%formulation%omega(1, 1:)
      next = 2 + 2 * machine%bodies
      do i = 1, size(self%columns)
        do q = 1, size(self%columns(i)%quantities)
          associate (elements => self%columns(i)%quantities(q)%elements, members => size(machine%banks(i)%bank%to))
            if (size(elements) == members) then
              call machine%banks(i)%bank%observe(machine%elements, q, 1, row(next:next + members - 1))
            else
              call machine%banks(i)%bank%observe(machine%elements, q, 1, self%values(:members))
              do e = 1, size(elements)
                row(next + e - 1) = self%values(elements(e))
              end do
            end if
            next = next + size(elements)
          end associate
        end do
      end do
      call self%formulation%reactions(1, self%lambda)
      call fill_reactions(machine%constraints, self%lambda, row(next:size(row) - 5))
      call self%fill_energies(row(size(row) - 4:))
    end associate
  end subroutine fill

  !> Multipliers, each followed by the torques on its members.
  pure subroutine fill_reactions(constraints, lambda, values)
    type(constraints_t), intent(in) :: constraints
    real(wp), intent(in) :: lambda(:)
    real(wp), intent(out) :: values(:)
    integer :: member, next, row

    member = 1
    next = 1
    do row = 1, size(lambda)
      values(next) = lambda(row)
      next = next + 1
      do while (member <= size(constraints%members%row))
        if (constraints%members%row(member) /= row) exit
        values(next) = constraints%members%factor(1, member) * lambda(row)
        next = next + 1
        member = member + 1
      end do
    end do
  end subroutine fill_reactions

  !> Kinetic and elastic energy, work put in, work taken out, and what does not add up.
  subroutine fill_energies(self, energies)
    class(trajectory_table_t), intent(inout) :: self
    real(wp), intent(out) :: energies(5)
    real(wp) :: work_in, work_out
    integer :: i

    work_in = 0.0_wp
    work_out = 0.0_wp
    do i = 1, size(self%is_source)
      associate (work => self%y(1, self%formulation%states + i))
        if (self%is_source(i)) then
          work_in = work_in + work
        else
          work_out = work_out - work
        end if
      end associate
    end do
    energies(1) = kinetic_energy(self%formulation)
    energies(2) = self%formulation%machine%stored_energy(1)
    energies(3) = work_in
    energies(4) = work_out
    energies(5) = (energies(1) + energies(2) - self%start_energy) - (work_in - work_out)
  end subroutine fill_energies

  !> Works and energies from the start to time t and state y.
  subroutine find_energy_balance(self, t, y, energies)
    class(trajectory_table_t), intent(inout) :: self
    real(wp), intent(in) :: t
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    type(energy_balance_t), intent(out) :: energies
    real(wp) :: row(size(self%labels))
    integer :: e

    call self%fill(t, y, row)
    associate (machine => self%formulation%machine, elastic => self%formulation%machine%elastic())
      allocate (energies%work_elements, source=work_element_names(machine))
      allocate (energies%work, source=y(self%formulation%states + 1:))
      allocate (energies%elastic_elements(size(elastic)))
      do e = 1, size(elastic)
        energies%elastic_elements(e)%text = machine%element_name(elastic(e))
      end do
      allocate (energies%stored_start, source=self%start_stored)
      allocate (energies%stored_end, source=stored_energies(machine))
    end associate
    energies%kinetic_start = self%start_kinetic
    energies%kinetic_end = kinetic_energy(self%formulation)
  end subroutine find_energy_balance

  !> Of the elastic elements, after `stored_energy` of the machine [J].
  function stored_energies(machine) result(energies)
    type(machine_t), intent(in) :: machine
    real(wp), allocatable :: energies(:)
    integer, allocatable :: elastic(:)
    integer :: i

    allocate (elastic, source=machine%elastic())
    allocate (energies(size(elastic)))
    do i = 1, size(elastic)
      energies(i) = machine%elements%stored(1, elastic(i))
    end do
  end function stored_energies

  pure function kinetic_energy(formulation) result(energy)
    class(formulation_t), intent(in) :: formulation
    real(wp) :: energy

    energy = formulation%machine%kinetic_energy(1, formulation%omega(1, 1:))
  end function kinetic_energy

end module nocdyn_trajectory_table
