!> Rows of L_lambda that move: u = g(v) + constant along the row of an element, with the angle v of its *driver*, another element,
!> or with the time v = t: joints whose ratio depends on the position, and prescribed motions.
!>
!> The moment of a row is a reaction. It acts on the element as M and on the driver as -g'(v) M, so that the joint itself has no
!> power. `nocdyn_joint_sets` finds it. The drivers are elements of a bank of their own, which follows.
module nocdyn_moving_rows
  use nocdyn_bank, only: bank_t
  use nocdyn_bank_states, only: bank_state_t
  use nocdyn_element_rows, only: rows_between
  use nocdyn_kinds, only: wp
  use nocdyn_quantities, only: form_total, new_quantity, quantity_t, rank_torque
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  !> Extensions say what g is: by formulas (`nocdyn_described_rows`), or by splines (`nocdyn_relation_rows`).
  type, abstract, extends(bank_t), public :: moving_rows_t
    logical :: is_driven_by_time = .false.   !! whether v is the time; else a bank of drivers follows
    character(len=3) :: moment_unit = 'N m'  !! of the moments on the elements; N where these are sliders
  contains
    procedure(motions_interface), deferred :: motions
    procedure :: connect_rows_only
    procedure :: quantities => torques_of_rows
  end type moving_rows_t

  abstract interface

    !> g of all elements and its first three derivatives by v.
    pure subroutine motions_interface(self, state, v, g)
      import :: bank_state_t, moving_rows_t, wp
      class(moving_rows_t), intent(in) :: self
      type(bank_state_t), intent(in) :: state         !! of this bank
      real(wp), intent(in) :: v(self%count)           !! [rad] or [s]
      real(wp), intent(out) :: g(0:3, self%count)     !! [rad] or [m] by powers of the unit of v
    end subroutine motions_interface

  end interface

contains

  !> Sets the connectivity; the elements have no moments of their own and store nothing.
  subroutine connect_rows_only(self, role, lanes, names, driven)
    class(moving_rows_t), intent(inout) :: self
    integer, intent(in) :: role                 !! role_...
    integer, intent(in) :: lanes
    type(string_t), intent(in) :: names(:)      !! [elements]
    integer, intent(in) :: driven(:)            !! body of each

    call self%connect(role, lanes, names, rows_between(0 * driven, driven))
    self%elastic = [integer ::]
    self%has_paper_law = .false.
    self%moving_rows = self%count
    if (.not. self%is_driven_by_time) self%with_work = [integer ::]
  end subroutine connect_rows_only

  !> The moments on the elements.
  subroutine torques_of_rows(self, columns)
    class(moving_rows_t), intent(in) :: self
    type(quantity_t), allocatable, intent(out) :: columns(:)
    integer :: e

    allocate (columns(1))
    columns(1) = new_quantity(trim(merge('force ', 'torque', self%moment_unit == 'N')), self%moment_unit, &
                              [(e, e=1, self%count)], trim(merge('force ', 'torque', self%moment_unit == 'N')) // &
                              ' on the moved body', 'with a positive speed', rank_torque, form_total, 1.0_wp)
  end subroutine torques_of_rows

end module nocdyn_moving_rows
