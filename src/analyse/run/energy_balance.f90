!> The energy balance of a run: the work of every element, and the energies at the start and at the end.
module nocdyn_energy_balance
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_table_text, only: cell, padded, text_width
  use nocdyn_text, only: rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  implicit none (type, external)
  private

  public :: work_element_names, put_energy_balance, append_energy_balance

  integer, parameter :: max_lines = 5   ! of each list

  type, public :: energy_balance_t
    type(string_t), allocatable :: work_elements(:)      !! "load work": elements whose work is integrated, with their role
    real(wp), allocatable :: work(:)               !! into the machine [J]
    type(string_t), allocatable :: elastic_elements(:)       !! names of the elastic couplings
    real(wp), allocatable :: stored_start(:), stored_end(:)   !! of these [J]
    real(wp) :: kinetic_start = 0.0_wp, kinetic_end = 0.0_wp  !! [J]
  contains
    procedure :: residual
  end type energy_balance_t

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
          names(next)%text = trim(bank%kind_name()) // ' ' // bank%names(bank%with_work(e))%text
          next = next + 1
        end do
      end associate
    end do
  end function work_element_names

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
    call json%put('work_in_J', self%work_elements, self%work)
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
    real(wp), parameter :: unseen = 1.0e-12_wp   ! share of all energies
    character(len=*), parameter :: last_line = 'energy balance error'
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: energies(:)
    integer :: i, width

    ! the works, and the energies that couplings and bodies have released
    allocate (energies, source=[self%work, self%stored_start - self%stored_end, self%kinetic_start - self%kinetic_end])
    allocate (names(size(energies)))
    names(:size(self%work)) = self%work_elements
    do i = 1, size(self%elastic_elements)
      names(size(self%work) + i)%text = 'stored in ' // self%elastic_elements(i)%text
    end do
    names(size(names))%text = 'kinetic energy'
    where (abs(energies) <= unseen * sum(abs(energies))) energies = 0.0_wp
    if (all(abs(energies) <= 0.0_wp)) return
    width = len(last_line)
    do i = 1, size(names)
      if (abs(energies(i)) > 0.0_wp) width = max(width, text_width(names(i)%text) + 2)
    end do
    call report%append_line('energy came from [J]')
    call append_side(names, energies, 1.0_wp, width, report)
    call report%append_line('and went to [J]')
    call append_side(names, energies, -1.0_wp, width, report)
    call report%append_line(padded(last_line, width) // cell(self%residual()))
  end subroutine append_energy_balance

  !> The entries of one side, the largest first.
  subroutine append_side(names, energies, sign, width, report)
    type(string_t), intent(in) :: names(:)
    real(wp), intent(in) :: energies(:)       !! [J]
    real(wp), intent(in) :: sign              !! of the energies of the side: 1 or -1
    integer, intent(in) :: width              !! of the names
    type(text_buffer_t), intent(inout) :: report
    real(wp) :: left(size(energies)), total
    integer :: i, largest, lines, others

    left = max(sign * energies, 0.0_wp)
    total = sum(max(energies, 0.0_wp))
    others = count(left > 0.0_wp)
    lines = merge(others, max_lines - 1, others <= max_lines)
    do i = 1, lines
      largest = maxloc(left, dim=1)
      call append_entry(report, names(largest)%text, left(largest), total, width)
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

    call report%append(padded('  ' // name, width) // cell(energy))
    if (total > 0.0_wp) call report%append('  ' // rounded_text(100.0_wp * energy / total, 3) // ' %')
    call report%append_line('')
  end subroutine append_entry

end module nocdyn_energy_balance
