!> Elements that belong to the ones of the bank before: their phases or drivers, which have no columns and no names of their own.
module nocdyn_phases
  use nocdyn_bank, only: bank_t, role_phase
  use nocdyn_element_rows, only: rows_between
  use nocdyn_quantities, only: quantity_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_phases

  type, extends(bank_t), public :: phases_t
  contains
    procedure :: connect_phases
    procedure :: quantities
    procedure :: named_count
  end type phases_t

contains

  !> The angles of bodies.
  function new_phases(lanes, names, body) result(bank)
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)   !! of the elements of the bank before
    integer, intent(in) :: body(:)           !! of each
    type(phases_t) :: bank

    call bank%connect_phases(lanes, names, body)
    bank%with_work = [integer ::]
  end function new_phases

  !> Sets the connectivity.
  subroutine connect_phases(self, lanes, names, body)
    class(phases_t), intent(inout) :: self
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)   !! [elements]
    integer, intent(in) :: body(:)           !! [elements]

    call self%connect(role_phase, lanes, names, rows_between(0 * body, body))
    self%elastic = [integer ::]
  end subroutine connect_phases

  !> There are none, as the columns are the ones of the bank before.
  subroutine quantities(self, columns)
    class(phases_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)

    allocate (columns(0))
  end subroutine quantities

  !> None has a name of its own.
  pure integer function named_count(self)
    class(phases_t), intent(in) :: self

    named_count = 0
  end function named_count

end module nocdyn_phases
