!> Checks whether a sweep may resume what its folder holds.
module nocdyn_sweep_resumption
  use nocdyn_errors, only: error_t, exit_input, raise
  use nocdyn_sweep_differences, only: header_difference
  use nocdyn_sweep_header, only: sweep_header_t
  use nocdyn_sweep_journal, only: is_of_rank, journal_name, journal_names, sweep_journal_t
  use nocdyn_sweep_provenance, only: read_provenance
  use nocdyn_text, only: joined, shown_path, string_t, to_text
  implicit none (type, external)
  private

  public :: check_journal, check_results, journals_text, refuse_other_journals, refuse_unfinished

  integer, parameter :: max_listed = 3   ! names

contains

  !> Refuses a journal of another sweep.
  subroutine check_journal(journal, header, error)
    type(sweep_journal_t), intent(in) :: journal
    type(sweep_header_t), intent(in) :: header            !! of the requested sweep
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: difference

    difference = change(journal%header, header)
    if (difference == '' .and. (journal%header%first /= header%first .or. journal%header%last /= header%last)) then
      difference = 'it holds the variants ' // to_text(journal%header%first) // ' to ' // to_text(journal%header%last) // &
                   ', not ' // to_text(header%first) // ' to ' // to_text(header%last)
    end if
    if (difference /= '') then
      call raise(error, exit_input, shown_path(journal%file%path) // ' belongs to another sweep: ' // difference // &
                 '; remove it, or choose another folder with --out')
    end if
  end subroutine check_journal

  !> Refuses to begin a sweep that journals hold a part of.
  subroutine refuse_unfinished(journals, error)
    type(sweep_journal_t), intent(in) :: journals(:)   !! of the sweep or of the shard
    type(error_t), allocatable, intent(out) :: error
    integer :: held, wanted

    held = sum(journals%done + journals%refused + journals%failed)
    wanted = journals(1)%header%last - journals(1)%header%first + 1
    if (held == wanted .and. wanted < journals(1)%header%variants) then
      call raise(error, exit_input, journals_text(journals) // ' holds all ' // to_text(wanted) // ' variants of this part, ' // &
                 'which nocdyn merge uses; to compute them again, remove it')
    else
      call raise(error, exit_input, journals_text(journals) // trim(merge(' holds ', ' hold  ', size(journals) == 1)) // ' ' // &
                 to_text(held) // ' of ' // to_text(wanted) // ' variants of an unfinished sweep; continue it with ' // &
                 '--resume, or remove ' // trim(merge('it  ', 'them', size(journals) == 1)))
    end if
  end subroutine refuse_unfinished

  !> "out/sweep.journal and 2 of ranks".
  function journals_text(journals) result(text)
    type(sweep_journal_t), intent(in) :: journals(:)
    character(len=:), allocatable :: text

    text = shown_path(journals(1)%file%path)
    if (size(journals) > 1) text = text // ' and ' // to_text(size(journals) - 1) // ' of ranks'
  end function journals_text

  !> The first difference between what a folder holds and the requested sweep; '' if there is none.
  function change(old, new) result(text)
    type(sweep_header_t), intent(in) :: old, new
    character(len=:), allocatable :: text

    text = header_difference(old, new, 'it was started by ' // old%source // ', this is ' // new%source, &
                             'the input has changed: ', 'the file of &sweep with the variants has changed')
  end function change

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
      if ((names(i)%text == whole .or. is_of_rank(names(i)%text)) .eqv. shards <= 1) cycle
      if (shards > 1) then
        call raise(error, exit_input, shown_path(folder) // ' holds the journal of a whole sweep, ' // names(i)%text // &
                   '; continue it with --resume and without --shard, remove it, or choose another folder with --out')
      else
        call raise(error, exit_input, shown_path(folder) // ' holds journals of parts of a sweep: ' // &
                   joined(names, ', ', max_listed) // &
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
    difference = change(old, header)
    if (difference /= '') call raise(error, exit_input, shown_path(folder) // ' holds the results of another sweep: ' // &
                                     difference // '; without --resume they are replaced')
  end subroutine check_results

end module nocdyn_sweep_resumption
