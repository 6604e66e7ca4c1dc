!> Where the groups and keys of an input come from, as bytes: lines of the file and overrides of the command line.
!>
!> A process that reads the text of `input_text` instead of the file takes these, so that its messages name the same places.
module nocdyn_input_sources
  use nocdyn_bytes, only: byte_reader_t, put_integers, put_text
  use nocdyn_input, only: input_t
  implicit none (type, external)
  private

  public :: pack_sources, unpack_sources

contains

  !> Packs the sources of an input into bytes, which `unpack_sources` reads.
  subroutine pack_sources(input, bytes)
    type(input_t), intent(in) :: input
    character(len=:), allocatable, intent(out) :: bytes
    integer :: g, i, used

    used = 0
    call put_integers(bytes, used, [size(input%overrides)])
    do i = 1, size(input%overrides)
      call put_text(bytes, used, input%overrides(i)%text)
    end do
    do g = 1, size(input%groups)
      associate (group => input%groups(g))
        call put_integers(bytes, used, [group%line, (group%values(i)%line, i=1, size(group%values)), &
                                        (group%values(i)%override, i=1, size(group%values))])
      end associate
    end do
    bytes = bytes(:used)
  end subroutine pack_sources

  !> Gives an input the sources of another one with the same groups in the same order.
  subroutine unpack_sources(bytes, input)
    character(len=*), intent(in) :: bytes
    type(input_t), intent(inout) :: input
    type(byte_reader_t) :: reader
    integer, allocatable :: numbers(:)
    integer :: count(1), g, i

    call reader%take_integers(bytes, count)
    if (allocated(input%overrides)) deallocate (input%overrides)
    allocate (input%overrides(count(1)))
    do i = 1, count(1)
      call reader%take_text(bytes, input%overrides(i)%text)
    end do
    do g = 1, size(input%groups)
      associate (group => input%groups(g))
        allocate (numbers(1 + 2 * size(group%values)))
        call reader%take_integers(bytes, numbers)
        group%line = numbers(1)
        do i = 1, size(group%values)
          group%values(i)%line = numbers(1 + i)
          group%values(i)%override = numbers(1 + size(group%values) + i)
        end do
        deallocate (numbers)
      end associate
    end do
    if (reader%is_short) error stop 'nocdyn_input_sources: the bytes are of another input'
  end subroutine unpack_sources

end module nocdyn_input_sources
