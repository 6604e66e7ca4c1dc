!> The energy balance of a run: the work of every element, and the energies at the start and at the end.
module nocdyn_energy_balance
  use nocdyn_bank, only: role_names
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: work_element_names, elastic_element_names, put_energy_balance, append_energy_balance

  integer, parameter :: max_lines = 10   ! of each list

  type, public :: energy_balance_t
    type(string_t), allocatable :: work_elements(:)      !! "load work": elements whose work is integrated, with their role
    real(wp), allocatable :: work(:)               !! into the machine [J]
    type(string_t), allocatable :: elastic_elements(:)       !! names of the elastic couplings
    real(wp), allocatable :: stored_start(:), stored_end(:)   !! of these [J]
    real(wp) :: kinetic_start = 0.0_wp, kinetic_end = 0.0_wp  !! [J]
  contains
    procedure :: residual
  end type energy_balance_t

  !> One line of the printed table.
  type :: entry_t
    character(len=:), allocatable :: name
    real(wp) :: energy = 0.0_wp   !! into the machine, negative if out of it [J]
  end type entry_t

contains

  !> The elements whose work is integrated, with their role, e.g. "motor drive", in the order of the quadratures.
  function work_element_names(machine) result(names)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: names(:)
    integer :: e, i, next

    allocate (names(size(machine%with_work)))
    next = 1
    do i = 1, size(machine%banks)
      associate (bank => machine%banks(i)%bank)
        do e = 1, size(bank%with_work)
          names(next)%text = trim(role_names(bank%role)) // ' ' // bank%names(bank%with_work(e))%text
          next = next + 1
        end do
      end associate
    end do
  end function work_element_names

  !> The names of the elements that can store energy, in the order of `elastic` of the machine.
  function elastic_element_names(machine) result(names)
    type(machine_t), intent(in) :: machine
    type(string_t), allocatable :: names(:)
    integer :: i

    associate (elastic => machine%elastic())
      allocate (names(size(elastic)))
      do i = 1, size(elastic)
        names(i)%text = machine%element_name(elastic(i))
      end do
    end associate
  end function elastic_element_names

  !> The energy balance error [J]: the increase of the stored energies, less the works.
  pure real(wp) function residual(self)
    class(energy_balance_t), intent(in) :: self

    residual = (self%kinetic_end + sum(self%stored_end) - (self%kinetic_start + sum(self%stored_start))) - sum(self%work)
  end function residual

  !> Writes all entries to summary.json.
  subroutine put_energy_balance(json, self)
    type(json_t), intent(inout) :: json
    type(energy_balance_t), intent(in) :: self
    integer :: i

    call json%open('energy_account')
    call json%open('work_in_J')
    do i = 1, size(self%work_elements)
      call json%put(self%work_elements(i)%text, self%work(i))
    end do
    call json%close()
    call json%open('stored_J')
    do i = 1, size(self%elastic_elements)
      call json%put(self%elastic_elements(i)%text, [self%stored_start(i), self%stored_end(i)])
    end do
    call json%close()
    call json%put('kinetic_J', [self%kinetic_start, self%kinetic_end])
    call json%put('residual_J', self%residual())
    call json%close()
  end subroutine put_energy_balance

  !> Appends two lists, where energy came from and where it went, with the shares of all that came; the largest entries of each
  !> and the sum of the others. Nothing is appended if there is no energy.
  subroutine append_energy_balance(report, self)
    type(text_buffer_t), intent(inout) :: report
    type(energy_balance_t), intent(in) :: self
    character(len=*), parameter :: last_line = 'energy balance error'
    type(entry_t), allocatable :: entries(:)
    integer :: i, width

    allocate (entries, source=all_entries(self))
    if (all(abs(entries%energy) <= 0.0_wp)) return
    width = len(last_line)
    do i = 1, size(entries)
      if (abs(entries(i)%energy) > 0.0_wp) width = max(width, text_width(entries(i)%name) + 2)
    end do
    call report%append_line('energy came from [J]')
    call append_side(entries, 1.0_wp, width, report)
    call report%append_line('and went to [J]')
    call append_side(entries, -1.0_wp, width, report)
    call report%append_line(padded(last_line, width) // cell(self%residual()))
  end subroutine append_energy_balance

  !> The works, and the energies that couplings and bodies have released.
  function all_entries(self) result(entries)
    type(energy_balance_t), intent(in) :: self
    type(entry_t), allocatable :: entries(:)
    integer :: i, n

    n = size(self%work_elements)
    allocate (entries(n + size(self%elastic_elements) + 1))
    do i = 1, n
      entries(i)%name = self%work_elements(i)%text
      entries(i)%energy = self%work(i)
    end do
    do i = 1, size(self%elastic_elements)
      entries(n + i)%name = 'stored in ' // self%elastic_elements(i)%text
      entries(n + i)%energy = self%stored_start(i) - self%stored_end(i)
    end do
    entries(size(entries))%name = 'kinetic energy'
    entries(size(entries))%energy = self%kinetic_start - self%kinetic_end
  end function all_entries

  !> The entries of one side, the largest first.
  subroutine append_side(entries, sign, width, report)
    type(entry_t), intent(in) :: entries(:)
    real(wp), intent(in) :: sign              !! of their energies: 1 or -1
    integer, intent(in) :: width              !! of the names
    type(text_buffer_t), intent(inout) :: report
    real(wp) :: left(size(entries)), total
    integer :: i, largest, lines, others

    left = max(sign * entries%energy, 0.0_wp)
    total = sum(max(entries%energy, 0.0_wp))
    others = count(left > 0.0_wp)
    lines = merge(others, max_lines - 1, others <= max_lines)
    do i = 1, lines
      largest = maxloc(left, dim=1)
      call append_entry(report, entries(largest)%name, left(largest), total, width)
      left(largest) = 0.0_wp
    end do
    others = others - lines
    if (others > 0) call append_entry(report, to_text(others) // ' others', sum(left), total, width)
  end subroutine append_side

  subroutine append_entry(report, name, energy, total, width)
    type(text_buffer_t), intent(inout) :: report
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: energy   !! [J]
    real(wp), intent(in) :: total    !! of which the share is printed [J]
    integer, intent(in) :: width
    character(len=:), allocatable :: line

    line = padded('  ' // name, width) // cell(energy)
    if (total > 0.0_wp) line = line // '  ' // rounded_text(100.0_wp * energy / total, 3) // ' %'
    call report%append_line(line)
  end subroutine append_entry

end module nocdyn_energy_balance
