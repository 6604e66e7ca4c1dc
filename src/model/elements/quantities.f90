!> What the elements of a bank put out: names, units, captions, and how the values follow from the ones of the elements.
module nocdyn_quantities
  use nocdyn_kinds, only: wp
  implicit none (type, external)
  private

  public :: new_quantity

  !> How the value follows from the ones of the element, which `quantity_t%factor` multiplies.
  integer, parameter, public :: form_observed = 0   !! by `observe` of the bank
  integer, parameter, public :: form_angle = 1      !! u
  integer, parameter, public :: form_speed = 2      !! u'
  integer, parameter, public :: form_elastic = 3    !! `restoring`
  integer, parameter, public :: form_applied = 4    !! `applied`
  integer, parameter, public :: form_total = 5      !! both together

  !> Key results of a table come first; `rank_detail` is left out of short tables.
  integer, parameter, public :: rank_moment = 1, rank_reaction = 2, rank_force = 3, rank_stress = 4, rank_torque = 5, &
    rank_loss = 6, rank_speed = 7, rank_slip = 8, rank_twist = 9, rank_current = 10, rank_detail = 11

  !> One quantity of some elements of a bank.
  type, public :: quantity_t
    character(len=16) :: symbol = ''       !! first part of its name, such as 'torque'
    character(len=8) :: unit = ''          !! in SI, such as 'N m'
    integer, allocatable :: elements(:)    !! that have it, numbered within the bank
    character(len=80) :: caption = ''      !! such as 'elastic moment'
    character(len=48) :: positive = ''     !! when it is positive, such as 'on the first body'
    character(len=8) :: point = ''         !! where in the element, such as '1' or 'max'; '' of the whole element
    integer :: rank = rank_torque          !! rank_...
    integer :: form = form_observed        !! form_...
    real(wp) :: factor = 1.0_wp            !! 1 or -1
    integer :: divisor = 0                 !! parameter of the bank that divides the value, 0: none
    integer, allocatable :: body(:)        !! whose speed multiplies the value, a power; [elements]; not allocated: none
  end type quantity_t

contains

  !> A quantity of the given form.
  pure function new_quantity(symbol, unit, elements, caption, positive, rank, form, factor) result(self)
    character(len=*), intent(in) :: symbol, unit, caption, positive
    integer, intent(in) :: elements(:)   !! numbered within the bank
    integer, intent(in) :: rank, form    !! rank_..., form_...
    real(wp), intent(in) :: factor       !! 1 or -1
    type(quantity_t) :: self

    self%symbol = symbol
    self%unit = unit
    self%caption = caption
    self%positive = positive
    allocate (self%elements, source=elements)
    self%rank = rank
    self%form = form
    self%factor = factor
  end function new_quantity

end module nocdyn_quantities
