!> The terms of excitations that are sines of the angle of a body, sorted for their formulas: the ones of one excitation that are
!> whole multiples of one order follow from one sine and one cosine.
module nocdyn_order_terms
  use nocdyn_kinds, only: wp
  use nocdyn_law_work, only: most_terms
  implicit none (type, external)
  private

  public :: new_order_terms

  type, public :: order_terms_t
    real(wp), allocatable :: base(:)          !! order of which others are multiples, [excitations]
    integer, allocatable :: multiples(:)      !! those that some excitation has, ascending
    integer, allocatable :: multiple(:, :)    !! term with that multiple of the base, 0 for none, [multiples, excitations]
    integer, allocatable :: single(:, :)      !! the other terms of each excitation, 0 for none, [most, excitations]
  end type order_terms_t

  real(wp), parameter :: same = 1.0e-12_wp   ! relative error of an order that counts as a multiple

contains

  !> Sorts the terms of some excitations.
  function new_order_terms(excitations, owner, order, is_order) result(self)
    integer, intent(in) :: excitations        !! how many
    integer, intent(in) :: owner(:)           !! excitation of each term
    real(wp), intent(in) :: order(:)          !! [terms]
    logical, intent(in) :: is_order(:)        !! whether a term is a sine of the angle alone with a positive order, [terms]
    type(order_terms_t) :: self
    integer :: e, k, n, others(excitations)
    logical :: has_several

    allocate (self%base(excitations))
    allocate (self%multiple(most_terms, excitations), self%single(size(owner), excitations), source=0)
    others = 0
    do e = 1, excitations
      self%base(e) = common_order(pack(order, owner == e .and. is_order))
      has_several = count(owner == e .and. is_order) > 1
      do k = 1, size(owner)
        if (owner(k) /= e) cycle
        n = 0
        if (is_order(k) .and. has_several) n = multiple_of(order(k), self%base(e))
        if (n > 0) then
          if (self%multiple(n, e) == 0) then
            self%multiple(n, e) = k
            cycle
          end if
        end if
        others(e) = others(e) + 1
        self%single(others(e), e) = k
      end do
    end do
    self%single = self%single(:maxval([0, others]), :)
    self%multiples = pack([(n, n=1, most_terms)], any(self%multiple > 0, dim=2))
  end function new_order_terms

  !> The largest part of the lowest order of which all are multiples; the lowest one itself if there is none that is large.
  pure real(wp) function common_order(orders) result(base)
    real(wp), intent(in) :: orders(:)   !! positive
    integer, parameter :: most_parts = 12
    integer :: parts

    base = 1.0_wp
    if (size(orders) == 0) return
    do parts = 1, most_parts
      base = minval(orders) / parts
      if (all(is_multiple(orders, base))) return
    end do
    base = minval(orders)
  end function common_order

  !> Which multiple of the base an order is; 0 if it is none, or one that is too high.
  pure integer function multiple_of(order, base) result(n)
    real(wp), intent(in) :: order, base

    n = nint(min(order / base, real(most_terms + 1, wp)))
    if (n > most_terms .or. .not. is_multiple(order, base)) n = 0
  end function multiple_of

  elemental logical function is_multiple(order, base)
    real(wp), intent(in) :: order, base

    is_multiple = abs(order - base * anint(order / base)) <= same * order
  end function is_multiple

end module nocdyn_order_terms
