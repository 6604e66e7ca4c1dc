!> Couplings whose elastic moment is a polynomial of the twist, of any order.
module nocdyn_polynomial_couplings
  use nocdyn_bank, only: bank_t
  use nocdyn_couplings, only: coupling_common_t, couplings_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-)
  use nocdyn_law_functions, only: polynomial
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: new_polynomial_couplings, elastic_coefficients, all_coefficients, add_coefficients, coefficients_of

  character(len=*), parameter :: first_name = 'stiffness'   ! the parameter p_1, and the key that may give it alone

  !> M_el = -(p_1 w + p_2 w^2 + ...) on the second body, w = u - rest_twist; eqs. (2), (3) are p_1 and p_3.
  type, extends(couplings_t), public :: polynomial_couplings_t
    integer :: order = 1
  contains
    procedure :: describe
  end type polynomial_couplings_t

contains

  !> Couplings with the elastic moment sum p_k w^k.
  function new_polynomial_couplings(keys, common) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(coupling_common_t), intent(in), optional :: common   !! of meshes; absent: as the keys say
    type(polynomial_couplings_t) :: bank
    real(wp), allocatable :: coefficient(:, :, :)
    integer :: e

    call bank%set_keys(keys, common)
    call bank%add_damping()
    coefficient = all_coefficients(keys, bank%is_mesh)
    call add_coefficients(bank, coefficient, keys%values('stiffness'), bank%order)
    bank%elastic = pack([(e, e=1, bank%count)], [(any(abs(coefficient(:, :, e)) > 0.0_wp), e=1, bank%count)])
    call bank%prepare_law()
  end function new_polynomial_couplings

  !> p_1, p_2, ...: the sum of both stiffnesses and of further coefficients, of order 3 at least.
  pure function elastic_coefficients(stiffness, cubic_stiffness, further) result(coefficient)
    real(wp), intent(in) :: stiffness, cubic_stiffness   !! [N m/rad], [N m/rad3]
    real(wp), intent(in) :: further(:)                   !! [N m/rad^k]
    real(wp) :: coefficient(max(3, size(further)))

    coefficient = 0.0_wp
    coefficient(:size(further)) = further
    coefficient(1) = coefficient(1) + stiffness
    coefficient(3) = coefficient(3) + cubic_stiffness
  end function elastic_coefficients

  !> p_1, p_2, ... of all couplings [N m/rad^k], [order, lanes, couplings]. A mesh has the stiffness alone.
  function all_coefficients(keys, is_mesh) result(coefficient)
    class(element_keys_t), intent(in) :: keys
    logical, intent(in) :: is_mesh
    real(wp), allocatable :: coefficient(:, :, :)
    real(wp), dimension(keys%lanes, size(keys%names)) :: cubic_stiffness, stiffness
    integer :: e, lane

    stiffness = keys%values('stiffness')
    if (is_mesh) then
      coefficient = spread(stiffness, 1, 1)
      return
    end if
    cubic_stiffness = keys%values('cubic_stiffness')
    allocate (coefficient(max(3, keys%longest('polynomial')), keys%lanes, size(keys%names)), source=0.0_wp)
    do e = 1, size(keys%names)
      do lane = 1, keys%lanes
        associate (one => elastic_coefficients(stiffness(lane, e), cubic_stiffness(lane, e), keys%numbers('polynomial', lane, e)))
          coefficient(:size(one), lane, e) = one
        end associate
      end do
    end do
  end function all_coefficients

  !> Adds the coefficients as parameters, without the ones of high order that are zero everywhere.
  subroutine add_coefficients(bank, coefficient, stiffness, order)
    class(bank_t), intent(inout) :: bank
    real(wp), intent(in) :: coefficient(:, :, :)   !! p_k [N m/rad^k], shape [order, lanes, couplings]
    real(wp), intent(in) :: stiffness(:, :)        !! of the key, shape [lanes, couplings]; p_1 where there are no others
    integer, intent(out) :: order                  !! of the last one that is left, at least 1
    logical :: is_key
    integer :: k

    order = 1
    do k = 2, size(coefficient, 1)
      if (any(abs(coefficient(k, :, :)) > 0)) order = k
    end do
    is_key = .false.
    if (order == 1) is_key = .not. any(abs(coefficient(1, :, :) - stiffness) > 0)
    call bank%add_parameter(first_name, coefficient(1, :, :), is_key)
    do k = 2, order
      call bank%add_parameter('coefficient ' // to_text(k), coefficient(k, :, :), is_key=.false.)
    end do
  end subroutine add_coefficients

  !> p_1, p_2, ... as expressions.
  function coefficients_of(bank, tape, order) result(p)
    class(bank_t), intent(in) :: bank
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: order
    type(expression_t) :: p(order)
    integer :: k

    p(1) = bank%parameter(tape, first_name)
    do k = 2, order
      p(k) = bank%parameter(tape, 'coefficient ' // to_text(k))
    end do
  end function coefficients_of

  subroutine describe(self, tape)
    class(polynomial_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: p(self%order), w
    integer :: k

    call self%couplings_t%describe(tape)
    w = self%twist_from_rest(tape)
    p = coefficients_of(self, tape, self%order)
    tape%restoring = node_of(-polynomial(p, w))
    tape%stored = node_of(w * polynomial([((1.0_wp / (k + 1)) * p(k), k=1, self%order)], w))
    call self%describe_phase(tape)
  end subroutine describe

end module nocdyn_polynomial_couplings
