!> What tells the inputs of two sweeps apart, in a sentence.
module nocdyn_sweep_differences
  use nocdyn_input_differences, only: find_differences
  use nocdyn_mistakes, only: mistakes_t
  use nocdyn_namelist, only: namelist_t
  use nocdyn_namelist_scanner, only: scan_namelist
  use nocdyn_text, only: append, string_t, to_text
  implicit none (type, external)
  private

  public :: input_difference

  integer, parameter :: most_told = 5   ! differences

contains

  !> Empty if nothing that counts differs. The title counts here, though it changes no number: files of a sweep carry it.
  function input_difference(old, new) result(text)
    character(len=*), intent(in) :: old, new   !! of `input_text`
    character(len=:), allocatable :: text
    type(string_t), allocatable :: changes(:), sentences(:)
    character(len=:), allocatable :: is, was
    integer :: i

    text = ''
    if (old == new) return
    allocate (sentences(0))
    was = title_of(old)
    is = title_of(new)
    if (was /= is) call append(sentences, '&case: title was ' // was // ', is ' // is)
    call find_differences(old, new, changes)
    do i = 1, size(changes)
      call append(sentences, changes(i)%text)
    end do
    do i = 1, min(size(sentences), most_told)
      if (i > 1) text = text // '; '
      text = text // sentences(i)%text
    end do
    if (size(sentences) > most_told) text = text // '; and ' // to_text(size(sentences) - most_told) // ' more'
  end function input_difference

  !> The title with its quotes; two of them around nothing if there is none.
  function title_of(text) result(title)
    character(len=*), intent(in) :: text   !! of `input_text`
    character(len=:), allocatable :: title
    type(namelist_t) :: namelist
    type(mistakes_t) :: mistakes
    integer :: a, g

    call scan_namelist(text, namelist, mistakes)
    title = "''"
    do g = 1, namelist%group_count
      if (namelist%groups(g)%name /= 'case') cycle
      do a = namelist%groups(g)%first_assignment, namelist%groups(g)%last_assignment
        associate (assignment => namelist%assignments(a))
          if (assignment%key == 'title') title = namelist%as_written(namelist%items(assignment%first_item))
        end associate
      end do
    end do
  end function title_of

end module nocdyn_sweep_differences
