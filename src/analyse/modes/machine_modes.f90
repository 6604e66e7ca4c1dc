!> The modes of a machine at its operating point: of a small one by dense matrices, of a large one by band matrices. Where these
!> are not certain to find all, dense ones do it, as far as they are affordable.
module nocdyn_machine_modes
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_large_modes, only: find_large_modes
  use nocdyn_linearisation, only: linearisation_t, linearise
  use nocdyn_mode_choice, only: keep_wanted
  use nocdyn_modes, only: find_modes, mode_t
  use nocdyn_operating_point, only: operating_point_t
  use nocdyn_text, only: to_text
  use nocdyn_wanted_modes, only: modes_choice_t
  implicit none (type, external)
  private

  public :: find_machine_modes

  integer, parameter :: most_dense = 200       ! coordinates of a small machine
  integer, parameter :: most_fallback = 1500   ! coordinates of a machine for which dense matrices are affordable; some minutes

contains

  !> Finds the modes that are wanted, in the order of `order_of`, and the undamped modes that they go on from.
  subroutine find_machine_modes(point, choice, elastic, linear, modes, error)
    type(operating_point_t), intent(inout) :: point   !! gets notes on modes that are left out
    type(modes_choice_t), intent(in) :: choice
    integer, intent(in) :: elastic(:)                 !! elements whose shares in the potential energy are wanted
    type(linearisation_t), intent(out) :: linear      !! of a large machine without `matrix`
    type(mode_t), allocatable, intent(out) :: modes(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: obstacle
    integer :: coordinates

    coordinates = point%formulation%machine%coordinates%freedoms
    if (coordinates > most_dense) then
      call find_large_modes(point, choice, elastic, coordinates <= most_fallback, linear, modes, obstacle, error)
      if (allocated(error) .or. obstacle == '') return
      if (coordinates > most_fallback) then
        call raise(error, exit_input, 'the modes of this machine need dense matrices, because ' // obstacle // &
                   ', and are found so for at most ' // to_text(most_fallback) // ' degrees of freedom; it has ' // &
                   to_text(coordinates))
        return
      end if
    end if
    call linearise(point%formulation, point%t, point%y, linear, error)
    if (allocated(error)) return
    if (size(linear%matrix) == 0) then
      call raise(error, exit_failed, point%notes(1)%text // ', so that nothing moves')
      return
    end if
    call find_modes(point%formulation, linear, elastic, modes, error)
    if (.not. allocated(error)) call keep_wanted(choice, linear, modes, point%notes)
  end subroutine find_machine_modes

end module nocdyn_machine_modes
