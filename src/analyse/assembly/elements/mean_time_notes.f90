!> Notes on times over which a run finds the mean rotation, where they are as short as a vibration.
module nocdyn_mean_time_notes
  use nocdyn_kinds, only: wp
  use nocdyn_loads, only: loads_t
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t
  implicit none (type, external)
  private

  public :: note_mean_times

contains

  !> Adds a note on the first element of each bank that damps vibrations, if its mean rotation follows them at the start speed.
  subroutine note_mean_times(machine, notes)
    type(machine_t), intent(in) :: machine   !! at its start
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)
    real(wp), parameter :: least = 1.0_wp   ! turns, with which order 1 has 93 % of its damping, order 1/2 74 %
    real(wp) :: turns
    integer :: b

    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      class is (loads_t)
        if (.not. bank%follows_mean) cycle
        associate (time => bank%parameters(bank%number_of('mean_time'))%value)
          turns = abs(machine%start_speed(1, bank%rows%last_body(1))) / turn * time(1, 1)
        end associate
        if (turns >= least .or. .not. turns > 0) cycle
        call append(notes, 'mean_time of ' // quoted(bank%names(1)%text) // ' is ' // rounded_text(turns, 2) // ' turns at ' // &
                           'the start speed: a run takes vibrations of so low orders for rotation, and damps them less')
      end select
    end do
  end subroutine note_mean_times

end module nocdyn_mean_time_notes
