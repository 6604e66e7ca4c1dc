!> The rows of trajectory.csv: all columns of a machine of one lane at a time and state.
module nocdyn_trajectory_table
  use nocdyn_element_sets, only: element_names, whole_names, whole_sums
  use nocdyn_energy_balance, only: energy_balance_t, work_element_names
  use nocdyn_formulation, only: formulation_t
  use nocdyn_kinds, only: wp
  use nocdyn_output_units, only: turn_units
  use nocdyn_signal_values, only: new_signal_values, signal_values_t
  use nocdyn_text, only: string_t
  use nocdyn_signals, only: label_signals, list_signals, signal_source_t, signal_t
  use nocdyn_units, only: from_si
  implicit none (type, external)
  private

  public :: new_trajectory_table

  integer, parameter, public :: at_start = 1, at_last_row = 2   !! where works and energies are kept

  type, public :: trajectory_table_t
    type(string_t), allocatable :: labels(:)
    type(signal_t), allocatable :: signals(:)      !! of the columns, in the units of the table
    integer, allocatable :: unit(:)                !! of each column: index of `units`, 0: SI unit
    type(signal_values_t) :: columns
    real(wp), private :: t(1) = 0.0_wp             !! [s]
    real(wp), allocatable, private :: y(:, :)      !! [1, states + quadratures]
    integer, allocatable, private :: elastic(:)    !! elements
    ! energies where they are kept [J]:
    real(wp), private :: kinetic(2) = 0.0_wp
    real(wp), allocatable, private :: stored(:, :) !! in the elastic elements, [elements, 2]
    real(wp), allocatable, private :: work(:, :)   !! of the elements with work, and kept in them, [elements, 2]
  contains
    procedure :: fill, keep_energies, find_energy_balance, works
  end type trajectory_table_t

contains

  !> A table for the columns of a machine. The energies of the start are those at `t_start`.
  type(trajectory_table_t) function new_trajectory_table(formulation, t_start, wanted) result(table)
    class(formulation_t), target, intent(inout) :: formulation   !! of one lane, with work integrals
    real(wp), intent(in) :: t_start                   !! [s]
    integer, intent(in) :: wanted(:)                  !! units of columns: indices of `units`; else SI units
    type(signal_source_t), allocatable :: sources(:)

    call list_signals(formulation%machine, table%signals)
    sources = table%signals%source
    table%columns = new_signal_values(formulation, sources)
    call turn_units(table%signals, wanted, table%unit)
    call label_signals(table%signals, table%labels)
    table%t(1) = t_start
    table%y = formulation%start()
    table%elastic = formulation%machine%elastic()
    allocate (table%stored(size(table%elastic), 2), table%work(size(formulation%machine%with_work), 2))
    call table%columns%observe(table%t, table%y)
    call table%columns%start_lane(1)
    call table%keep_energies(at_start, table%y(1, :))
  end function new_trajectory_table

  !> The row of the table at a time and state.
  subroutine fill(self, t, y, row)
    class(trajectory_table_t), intent(inout) :: self
    real(wp), intent(in) :: t                  !! [s]
    real(wp), contiguous, intent(in) :: y(:)   !! [states + quadratures]
    real(wp), intent(inout) :: row(:)          !! [columns]
    integer :: i

    self%t(1) = t
    self%y(1, :) = y
    call self%columns%observe(self%t, self%y)
    call self%columns%fill_row(1, t, y, row)
    do i = 1, size(self%unit)   ! without memory for the whole row
      row(i) = from_si(row(i), self%unit(i))
    end do
  end subroutine fill

  !> Keeps the works and energies where the columns were observed last.
  subroutine keep_energies(self, place, y)
    class(trajectory_table_t), intent(inout) :: self
    integer, intent(in) :: place   !! at_start or at_last_row
    real(wp), intent(in) :: y(:)   !! there, [states + quadratures]
    integer :: i

    associate (formulation => self%columns%formulation, machine => self%columns%formulation%machine, &
               elements => self%columns%formulation%state%elements)
      self%kinetic(place) = self%columns%kinetic_energy(1)
      do i = 1, size(self%elastic)   ! without memory for them in every row
        self%stored(i, place) = elements%stored(1, self%elastic(i))
      end do
      do i = 1, size(machine%with_work)
        self%work(i, place) = y(formulation%states + i) + elements%kept(1, machine%with_work(i))
      end do
    end associate
  end subroutine keep_energies

  !> Works and energies from the start to the last row that was kept.
  subroutine find_energy_balance(self, balance)
    class(trajectory_table_t), intent(in) :: self
    type(energy_balance_t), intent(out) :: balance
    type(string_t), allocatable :: names(:)

    allocate (names, source=work_element_names(self%columns%formulation%machine))
    allocate (balance%work_elements, source=whole_names(names))
    allocate (balance%work, source=whole_sums(names, self%works()))
    deallocate (names)
    allocate (names, source=element_names(self%columns%formulation%machine, self%elastic))
    allocate (balance%elastic_elements, source=whole_names(names))
    allocate (balance%stored_start, source=whole_sums(names, self%stored(:, at_start)))
    allocate (balance%stored_end, source=whole_sums(names, self%stored(:, at_last_row)))
    balance%kinetic_start = self%kinetic(at_start)
    balance%kinetic_end = self%kinetic(at_last_row)
  end subroutine find_energy_balance

  !> The work of each element into the machine from the start to the last row [J], [`machine%with_work`].
  pure function works(self)
    class(trajectory_table_t), intent(in) :: self
    real(wp) :: works(size(self%work, 1))

    works = self%work(:, at_last_row) - self%work(:, at_start)
  end function works

end module nocdyn_trajectory_table
