!> Notes on rubber couplings where their temperature, amplitude and frequency are not found.
module nocdyn_rubber_notes
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_rubber_laws, only: factors_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t
  implicit none (type, external)
  private

  public :: note_given_conditions

contains

  !> Notes the conditions that couplings have without an iteration, and how far the factors of their tables are from these.
  subroutine note_given_conditions(machine, where, notes)
    type(machine_t), intent(in) :: machine
    character(len=*), intent(in) :: where   !! "over the time"
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: text
    integer :: r

    if (.not. allocated(machine%rubber)) return
    do r = 1, size(machine%rubber)
      associate (law => machine%rubber(r))
        text = ''
        if (law%heats_up) then
          text = '; it has its ambient temperature, ' // rounded_text(law%ambient, 4) // ' degC'
          call add_range(law%by_temperature, 'temperature', [law%by_temperature%stiffness(law%ambient), &
                                                             law%by_temperature%damping(law%ambient)], text)
        end if
        call add_range(law%by_amplitude, 'amplitude', [1.0_wp, 1.0_wp], text)
        if (text == '') cycle
        call append(notes, where // ' coupling ' // quoted(machine%element_name(law%element)) // ' does not change by its ' // &
                           'own vibration, as it does in nocdyn response' // text)
      end associate
    end do
  end subroutine note_given_conditions

  !> "; by the temperature its stiffness may be 70 to 110 % of this, its relative damping 60 to 100 %".
  subroutine add_range(factors, name, here, text)
    type(factors_t), intent(in) :: factors
    character(len=*), intent(in) :: name   !! of the quantity
    real(wp), intent(in) :: here(2)        !! factors that are taken
    character(len=:), allocatable, intent(inout) :: text
    real(wp) :: damping(2), stiffness(2)

    if (.not. factors%are_given) return
    call factors%write_range(stiffness, damping)
    text = text // '; by its ' // name // ' its stiffness may be '
    call add_percent(stiffness / here(1), text)
    text = text // ' % of this, its relative damping '
    call add_percent(damping / here(2), text)
    text = text // ' %'
  end subroutine add_range

  !> Adds "70 to 110".
  subroutine add_percent(range, text)
    real(wp), intent(in) :: range(2)
    character(len=:), allocatable, intent(inout) :: text

    text = text // rounded_text(100.0_wp * range(1), 3) // ' to ' // rounded_text(100.0_wp * range(2), 3)
  end subroutine add_percent

end module nocdyn_rubber_notes
