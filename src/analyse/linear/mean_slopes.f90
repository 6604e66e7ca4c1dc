!> What a report says of torques that follow the mean speed of a cycle: that they do not damp oscillations.
module nocdyn_mean_slopes
  use nocdyn_element_sets, only: element_names
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, joined, rounded_text, string_t
  implicit none (type, external)
  private

  public :: note_mean_slopes

contains

  !> Adds a note if a torque that follows the mean speed has a slope over it.
  subroutine note_mean_slopes(machine, slope, notes)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: slope(:)   !! derivatives of the torques by the speeds, others have no part [N m s/rad], [elements]
    type(string_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: most_names = 4
    integer :: e
    integer, allocatable :: changing(:)

    changing = pack([(e, e=1, size(slope))], machine%follows_mean_speed() .and. abs(slope) > 0)
    if (size(changing) == 0) return
    associate (steepest => slope(changing(maxloc(abs(slope(changing)), dim=1))))
      call append(notes, 'the mean torque of ' // joined(element_names(machine, changing), ', ', most_names) // &
                         ' changes over the speed by up to ' // rounded_text(steepest, 3) // ' N m s/rad: it follows the ' // &
                         'mean speed and does not damp oscillations here; nocdyn run takes it at the speed of the moment, ' // &
                         'where it does')
    end associate
  end subroutine note_mean_slopes

end module nocdyn_mean_slopes
