!> Checks whether a sweep may resume what its folder holds.
module nocdyn_sweep_resumption
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_sweep_differences, only: input_difference
  use nocdyn_sweep_header, only: sweep_header_t
  use nocdyn_sweep_journal, only: journal_name, journal_names, sweep_journal_t
  use nocdyn_sweep_provenance, only: read_provenance
  use nocdyn_text, only: joined, string_t, to_text
  implicit none (type, external)
  private

  public :: check_journal, check_results, refuse_other_journals

  integer, parameter :: max_listed = 3   ! names

contains

  !> Refuses a journal of another sweep, and one of this sweep without --resume.
  subroutine check_journal(journal, header, resumes, error)
    type(sweep_journal_t), intent(in) :: journal
    type(sweep_header_t), intent(in) :: header            !! of the requested sweep
    logical, intent(in) :: resumes
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: difference

    difference = header_difference(journal%header, header)
    if (difference /= '') then
      call raise(error, exit_input, journal%path() // ' belongs to another sweep: ' // difference // &
                 '; remove it, or choose another folder with --out')
    else if (.not. resumes) then
      call raise(error, exit_input, journal%path() // ' holds ' // journal_content_text(journal))
    end if
  end subroutine check_journal

  !> How many variants a journal holds, and what can be done with it.
  function journal_content_text(journal) result(text)
    type(sweep_journal_t), intent(in) :: journal
    character(len=:), allocatable :: text
    integer :: held, wanted

    held = journal%done + journal%refused + journal%failed
    wanted = journal%header%last - journal%header%first + 1
    if (held == wanted .and. wanted < journal%header%variants) then
      text = 'all ' // to_text(wanted) // ' variants of this part, which nocdyn merge uses; ' // &
             'to compute them again, remove it'
    else
      text = to_text(held) // ' of ' // to_text(wanted) // ' variants of an unfinished sweep; continue it with ' // &
             '--resume, or remove it'
    end if
  end function journal_content_text

  !> The first difference between two sweeps as a phrase; '' if they are the same.
  function header_difference(old, new) result(text)
    type(sweep_header_t), intent(in) :: old, new
    character(len=:), allocatable :: text

    text = ''
    if (old%source /= new%source) then
      text = 'it was started by ' // old%source // ', this is ' // new%source
      return
    end if
    text = input_difference(old%input_text, new%input_text)
    if (text /= '') then
      text = 'the input has changed: ' // text
    else if (old%list_checksum /= new%list_checksum) then
      text = 'the file of &sweep with the variants has changed'
    else if (old%first /= new%first .or. old%last /= new%last) then
      text = 'it holds the variants ' // to_text(old%first) // ' to ' // to_text(old%last) // ', not ' // &
             to_text(new%first) // ' to ' // to_text(new%last)
    end if
  end function header_difference

  !> Refuses journals of a whole sweep and of parts in one folder: `nocdyn merge` would use all of them.
  subroutine refuse_other_journals(folder, shards, error)
    character(len=*), intent(in) :: folder
    integer, intent(in) :: shards                         !! of the requested sweep; at most 1: the whole sweep
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: names(:)
    character(len=:), allocatable :: whole
    integer :: i

    whole = journal_name(1, 1)
    allocate (names, source=journal_names(folder))
    do i = 1, size(names)
      if (names(i)%text == whole .eqv. shards <= 1) cycle
      if (shards > 1) then
        call raise(error, exit_input, folder // ' holds the journal of a whole sweep, ' // whole // '; continue it with ' // &
                   '--resume and without --shard, remove it, or choose another folder with --out')
      else
        call raise(error, exit_input, folder // ' holds journals of parts of a sweep: ' // joined(names, ', ', max_listed) // &
                   '; continue them with --shard, remove them, or choose another folder with --out')
      end if
      return
    end do
  end subroutine refuse_other_journals

  !> Refuses results of another sweep in the folder.
  subroutine check_results(folder, header, error)
    character(len=*), intent(in) :: folder
    type(sweep_header_t), intent(in) :: header            !! of the requested sweep
    type(error_t), allocatable, intent(out) :: error
    type(sweep_header_t) :: old
    character(len=:), allocatable :: difference

    call read_provenance(folder, old, error)
    if (allocated(error)) return
    old%first = header%first
    old%last = header%last
    difference = header_difference(old, header)
    if (difference /= '') call raise(error, exit_input, folder // ' holds the results of another sweep: ' // difference // &
                                     '; without --resume they are replaced')
  end subroutine check_results

end module nocdyn_sweep_resumption
