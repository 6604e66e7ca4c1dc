!> The numbers that a fit finds: &unknown of an input.
module nocdyn_unknowns
  use nocdyn_errors, only: error_t
  use nocdyn_free_numbers, only: free_number_t, read_free_number, refuse_twice
  use nocdyn_input, only: diagnostics_t, input_t
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: read_unknowns

  type, extends(free_number_t), public :: unknown_t
    logical :: has_prior = .false.
    real(wp) :: prior = 0.0_wp, deviation = 0.0_wp   !! what is expected, with its standard deviation
  end type unknown_t

contains

  !> Reads all unknowns.
  subroutine read_unknowns(input, unknowns, error)
    type(input_t), intent(in) :: input
    type(unknown_t), allocatable, intent(out) :: unknowns(:)
    type(error_t), allocatable, intent(out) :: error   !! names file, line, group and key
    type(diagnostics_t) :: diagnostics
    integer, allocatable :: groups(:)
    integer :: i

    allocate (groups, source=input%groups_named('unknown'))
    allocate (unknowns(size(groups)))
    do i = 1, size(groups)
      associate (group => input%groups(groups(i)))
        call read_free_number(input, groups(i), group%number('low'), group%number('high'), .false., unknowns(i), diagnostics)
        unknowns(i)%has_prior = group%has_value('prior')
        unknowns(i)%prior = group%number('prior', absent=0.0_wp)
        unknowns(i)%deviation = group%number('deviation', absent=1.0_wp)
      end associate
      call refuse_twice(input, unknowns(:i), 'unknown', diagnostics)
    end do
    call input%refuse(diagnostics, error)
  end subroutine read_unknowns

end module nocdyn_unknowns
