!> The room that results need on the disk, against a limit and what is free.
module nocdyn_disk_room
  use nocdyn_errors, only: error_t, exit_file, exit_input, raise
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: rounded_text, shown_path
  implicit none (type, external)
  private

  public :: bytes_text, check_room

  real(wp), parameter :: most_bytes = 100.0e9_wp   !! of the results of a command

contains

  !> Refuses results that would be larger than `most_bytes` or than the free disk.
  subroutine check_room(what, bytes, free, folder, advice, error)
    character(len=*), intent(in) :: what     !! file, line and what is to be written, for the message
    real(wp), intent(in) :: bytes            !! estimate
    real(wp), intent(in) :: free             !! on the disk of the folder [bytes]
    character(len=*), intent(in) :: folder   !! of the results; need not exist
    character(len=*), intent(in) :: advice   !! what to change
    type(error_t), allocatable, intent(out) :: error

    if (bytes > most_bytes) then
      call raise(error, exit_input, what // ' would take about ' // bytes_text(bytes) // '; allowed: at most ' // &
                 bytes_text(most_bytes) // '; ' // advice)
    else if (bytes > free) then
      call raise(error, exit_file, what // ' would take about ' // bytes_text(bytes) // '; free on the disk of ' // &
                 shown_path(folder) // ': ' // bytes_text(free) // '; ' // advice // ', or choose another folder with --out')
    end if
  end subroutine check_room

  !> "1.2 GB", "20 MB".
  function bytes_text(bytes) result(text)
    real(wp), intent(in) :: bytes
    character(len=:), allocatable :: text

    text = rounded_text(bytes / 1.0e6_wp, 2) // ' MB'
    if (bytes >= 1.0e9_wp) text = rounded_text(bytes / 1.0e9_wp, 2) // ' GB'
  end function bytes_text

end module nocdyn_disk_room
