!> Shafts whose inertia is lumped: chains of springs and masses in place of the nodes of spectral elements, for Holzer's tables.
module nocdyn_lumped_shafts
  use nocdyn_input, only: group_t, input_t, value_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shaft_segments, only: segment_parts
  use nocdyn_shafts, only: shafts_t
  use nocdyn_text, only: append, string_t
  implicit none (type, external)
  private

  public :: lump_shafts

contains

  !> Replaces the shafts of an input by chains with as many nodes as a machine of it has. Each segment is cut into equal parts,
  !> and half of the inertia of a part stands at each of its ends.
  subroutine lump_shafts(machine, input, names)
    type(machine_t), intent(in) :: machine
    type(input_t), intent(inout) :: input
    type(string_t), allocatable, intent(out) :: names(:)   !! of the shafts that were no chains
    integer, allocatable :: groups(:)
    integer :: b, e, s

    allocate (names(0))
    allocate (groups, source=input%groups_named('shaft'))
    do b = 1, size(machine%banks)
      select type (bank => machine%banks(b)%bank)
      type is (shafts_t)
        do s = 1, size(bank%shafts)
          associate (elements => bank%shafts(s)%elements)
            if (all([(size(elements(e)%bodies) == 2, e=1, size(elements))])) cycle
            call append(names, input%groups(groups(s))%name)
            call lump(sum([(size(elements(e)%bodies) - 1, e=1, size(elements))]), input%groups(groups(s)))
          end associate
        end do
      class default
        cycle
      end select
    end do
  end subroutine lump_shafts

  !> Cuts the segments of a shaft.
  subroutine lump(total, shaft)
    integer, intent(in) :: total   !! parts
    type(group_t), intent(inout) :: shaft
    integer, allocatable :: parts(:)   ! of each segment

    allocate (parts, source=segment_parts(shaft%numbers('lengths'), total))
    call repeat_values('lengths', shaft%numbers('lengths') / parts)
    call repeat_values('diameters', shaft%numbers('diameters'))
    call repeat_values('bores', shaft%numbers('bores'))
    call repeat_values('shear_modulus', shaft%numbers('shear_modulus'))
    call repeat_values('density', shaft%numbers('density'))
    shaft%values(shaft%key_position('nodes')) = value_t(is_given=.true., whole_numbers=[total - 1])

  contains

    !> Gives the value of a segment to each of its parts; one value is that of all segments.
    subroutine repeat_values(key, values)
      character(len=*), intent(in) :: key
      real(wp), intent(in) :: values(:)
      real(wp), allocatable :: list(:)
      integer :: i

      if (size(values) /= size(parts)) return
      allocate (list(0))
      do i = 1, size(parts)
        list = [list, spread(values(i), 1, parts(i))]
      end do
      shaft%values(shaft%key_position(key))%numbers = list
    end subroutine repeat_values

  end subroutine lump

end module nocdyn_lumped_shafts
