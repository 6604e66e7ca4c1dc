!> The files of one analysis: they appear together or not at all.
module nocdyn_result_files
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_output_file, only: output_file_t
  use nocdyn_posix, only: hold_interrupts, is_to_stop, remove_file
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  !> Files that are written under hidden names. The last one is the report on the others: `finish` removes the one of an earlier
  !> analysis first and names the new one last, so that a folder with a report has all of its files.
  type, public :: result_files_t
    type(output_file_t), allocatable :: files(:)           !! to be written, in the order of the names
    type(string_t), allocatable, private :: names(:)
    character(len=:), allocatable, private :: folder
  contains
    procedure :: open => open_all
    procedure :: complete
    procedure :: finish
    procedure :: discard
  end type result_files_t

contains

  !> Opens all files. A failure is kept until `complete` or `finish`.
  subroutine open_all(self, folder, names)
    class(result_files_t), intent(out) :: self
    character(len=*), intent(in) :: folder     !! made if it does not exist
    type(string_t), intent(in) :: names(:)     !! of the finished files; the report comes last
    integer :: i

    call hold_interrupts()
    self%folder = folder
    allocate (self%names, source=names)
    allocate (self%files(size(names)))
    do i = 1, size(names)
      call self%files(i)%open(folder, names(i)%text)
    end do
  end subroutine open_all

  !> Closes all files, which keep their hidden names. If one of them failed, there is none, and an error.
  subroutine complete(self, error)
    class(result_files_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    do i = 1, size(self%files)
      call self%files(i)%complete(self%names(i)%text, error)
      if (allocated(error)) exit
    end do
    if (allocated(error)) call self%discard()
  end subroutine complete

  !> Closes all files that are open, then gives all their names, unless a program that stops at signals has got one.
  subroutine finish(self, error)
    class(result_files_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    call self%complete(error)
    if (allocated(error)) return
    if (is_to_stop()) then
      call self%discard()
      call raise(error, exit_failed, 'interrupted')
      return
    end if
    if (size(self%files) > 1) call remove_file(self%folder // '/' // self%names(size(self%names))%text)
    do i = 1, size(self%files)
      call self%files(i)%finish(self%names(i)%text, error)
      if (allocated(error)) exit
    end do
    if (allocated(error)) call self%discard()
  end subroutine finish

  !> Closes and removes the files that have no name yet.
  subroutine discard(self)
    class(result_files_t), intent(inout) :: self
    integer :: i

    do i = 1, size(self%files)
      call self%files(i)%discard()
    end do
  end subroutine discard

end module nocdyn_result_files
