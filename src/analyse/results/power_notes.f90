!> Notes on motors, engines and compressors whose power has the other sign than their name says.
module nocdyn_power_notes
  use nocdyn_bank, only: role_motor
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: note_power_signs

contains

  !> Adds a note on each motor and engine that takes power, and on each compressor that gives some.
  subroutine note_power_signs(machine, power, unit, states, notes)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: power(:, :)       !! mean powers, or works, into the machine, [`machine%with_work`, states]
    character(len=*), intent(in) :: unit      !! W, or J of a run
    character(len=*), intent(in) :: states    !! what several states are, e.g. 'speeds'
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=:), allocatable :: name
    real(wp) :: gives(size(power, 2))
    integer :: b, e

    do b = 1, size(machine%banks)
      associate (bank => machine%banks(b)%bank)
        if (bank%role == role_motor) then
          do e = 1, bank%count
            call note_one('motor ' // quoted(bank%names(e)%text) // ' generates: it takes ', -power_of(bank%first + e - 1, 1))
          end do
        else if (bank%works /= '' .and. bank%count > 0) then
          ! the elements are the cylinders NAME_1, NAME_2, ...
          name = bank%names(1)%text(:index(bank%names(1)%text, '_', back=.true.) - 1)
          gives = power_of(bank%first, bank%count)
          if (bank%works == 'engine') call note_one('engine ' // quoted(name) // ' works as a compressor: it takes ', -gives)
          if (bank%works == 'compressor') call note_one('compressor ' // quoted(name) // ' works as a motor: it gives ', gives)
        end if
      end associate
    end do

  contains

    !> Sum over some elements, in each state.
    pure function power_of(first, count)
      integer, intent(in) :: first, count
      real(wp) :: power_of(size(power, 2))
      integer :: i

      power_of = [(sum(power(:, i), mask=machine%with_work >= first .and. machine%with_work < first + count), &
                   i=1, size(power_of))]
    end function power_of

    subroutine note_one(text, wrong)
      character(len=*), intent(in) :: text
      real(wp), intent(in) :: wrong(:)   !! power of the unexpected sign, [states]
      real(wp), parameter :: least = 1.0e-3_wp   ! of all that is put into the machine
      character(len=:), allocatable :: note
      logical :: counts(size(wrong))

      counts = wrong > least * sum(max(power, 0.0_wp), dim=1)
      if (.not. any(counts)) return
      note = text
      if (count(counts) > 1) note = note // 'up to '
      note = note // rounded_text(maxval(wrong, mask=counts), 3) // ' ' // unit
      if (unit == 'J') note = note // ' in this run'
      if (size(wrong) > 1) note = note // ' at ' // to_text(count(counts)) // ' of ' // to_text(size(wrong)) // ' ' // states
      call append(notes, note)
    end subroutine note_one

  end subroutine note_power_signs

end module nocdyn_power_notes
