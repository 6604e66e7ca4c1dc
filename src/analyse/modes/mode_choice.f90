!> Which oscillating modes of a machine are wanted, and the ones that are kept of all.
module nocdyn_mode_choice
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: linearisation_t
  use nocdyn_modes, only: mode_oscillating, mode_t
  use nocdyn_text, only: append, counted, rounded_text, string_t, to_text
  use nocdyn_units, only: in_si, unit_hz
  use nocdyn_wanted_modes, only: keep_numbers, modes_choice_t
  implicit none (type, external)
  private

  public :: keep_wanted, note_choice

contains

  !> Keeps the wanted ones of all modes of a machine: with a range no others than oscillating ones.
  subroutine keep_wanted(choice, linear, modes, notes)
    type(modes_choice_t), intent(in) :: choice
    type(linearisation_t), intent(inout) :: linear            !! keeps the undamped modes of the same numbers or frequencies
    type(mode_t), allocatable, intent(inout) :: modes(:)      !! in the order of `order_of`
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer :: below, first, i, last, oscillation
    logical :: is_kept(size(modes))
    real(wp) :: ends(2)

    oscillation = 0
    if (choice%count == 0 .and. .not. choice%has_range) return
    do i = 1, size(modes)
      is_kept(i) = .not. choice%has_range
      if (modes(i)%kind /= mode_oscillating) cycle
      oscillation = oscillation + 1
      is_kept(i) = oscillation <= choice%count
      if (choice%has_range) is_kept(i) = modes(i)%frequency() >= choice%range_hz(1) .and. &
                                         modes(i)%frequency() <= choice%range_hz(2)
    end do
    below = size(linear%natural) - size(linear%flexible)
    first = 1
    last = min(size(linear%natural), below + choice%count)
    if (choice%has_range) then
      ends = in_si(choice%range_hz, unit_hz)
      first = 1 + count(linear%natural < ends(1))
      last = count(linear%natural <= ends(2))
    end if
    call note_choice(choice, size(linear%flexible), count(linear%natural(linear%flexible) < in_si(choice%range_hz(1), unit_hz)), &
                     count(is_kept .and. modes%kind == mode_oscillating), notes)
    call keep_numbers(first, last, linear)
    modes = pack(modes, is_kept)
  end subroutine keep_wanted

  !> Adds a note on the modes that are left out.
  subroutine note_choice(choice, undamped, below, modes, notes)
    type(modes_choice_t), intent(in) :: choice
    integer, intent(in) :: undamped        !! undamped modes of the machine that are not rigid
    integer, intent(in) :: below           !! of these, the ones below the range
    integer, intent(in) :: modes           !! oscillating modes that are kept
    type(string_t), allocatable, intent(inout) :: notes(:)

    if (choice%has_range) then
      call append(notes, counted(modes, 'oscillating mode is', 'oscillating modes are') // ' from ' // &
                         rounded_text(choice%range_hz(1), 8) // ' to ' // rounded_text(choice%range_hz(2), 8) // ' Hz; of ' // &
                         to_text(undamped) // ' undamped ones, ' // counted(below, 'is below', 'are below'))
    else if (modes < undamped) then
      call append(notes, counted(modes, 'oscillating mode is', 'oscillating modes are') // ' listed, of the lowest ' // &
                         'frequencies of ' // to_text(undamped) // ' undamped ones; others with --modes NUMBER or ' // &
                         '--range_hz LOW,HIGH')
    end if
  end subroutine note_choice

end module nocdyn_mode_choice
