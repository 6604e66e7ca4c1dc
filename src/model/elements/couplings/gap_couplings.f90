!> Couplings with backlash: no moment in a gap, contact beyond its edges.
!>
!> In contact the elastic moment M is a function of the penetration of the edge. The damping moment is d u', limited to the
!> size of M: the contact never pulls, and its moment starts at zero. It is the law of `ElastoBacklash` of the Modelica
!> Standard Library. The damping moment does work. While the bodies separate faster than the contact can follow, it is the
!> opposite of the elastic moment and dissipates the energy that the contact still stores.
module nocdyn_gap_couplings
  use nocdyn_couplings, only: coupling_common_t, couplings_t
  use nocdyn_described_elements, only: boundary_width
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, literal, node_of, operator(*), operator(+), operator(-), pick
  use nocdyn_law_functions, only: add_guard, larger, polynomial, size_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_couplings, only: add_coefficients, all_coefficients, coefficients_of
  implicit none (type, external)
  private

  public :: new_gap_couplings

  type, extends(couplings_t), public :: gap_couplings_t
    integer :: order = 1
  contains
    procedure :: describe
  end type gap_couplings_t

  ! the branches; after them those at the edge -gap / 2
  integer, parameter :: free = 1
  integer, parameter :: contact = 2      ! the damping moment is d u'
  integer, parameter :: closing = 3      ! d u' is above the elastic moment; the damping moment is equal to that
  integer, parameter :: separating = 4   ! d u' would make the contact pull; the moments cancel
  integer, parameter :: branches = 7

contains

  !> Couplings with play, the elastic moment being sum p_k x^k of the penetration x. The damping is that in contact, the rest
  !> twist is at the middle of the gap, the friction acts in the gap and in contact.
  function new_gap_couplings(keys, common) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(coupling_common_t), intent(in), optional :: common   !! of meshes; absent: as the keys say
    type(gap_couplings_t) :: bank
    real(wp), allocatable :: coefficient(:, :, :), gap(:, :)
    integer :: e

    call bank%set_keys(keys, common)
    coefficient = all_coefficients(keys, bank%is_mesh)
    call add_coefficients(bank, coefficient, keys%values('stiffness'), bank%order)
    gap = keys%values(merge('backlash', 'gap     ', bank%is_mesh))
    if (any(gap <= 0) .or. .not. all(any(abs(coefficient) > 0, dim=1))) then
      error stop 'nocdyn_gap_couplings: gaps have widths and edges stiffness'
    end if
    call bank%add_parameter('gap', gap, is_key=bank%order == 1)   ! the powers of others are looked at in assembly
    bank%with_work = pack([(e, e=1, bank%count)], [(any(bank%with_work == e) .or. can_pull(coefficient(:, :, e)), &
                                                  e=1, bank%count)])
    bank%elastic = [(e, e=1, bank%count)]
    call bank%add_switches([('edge of the gap', e=1, bank%count)], branches)
    call bank%prepare_law()
  end function new_gap_couplings

  !> Whether the elastic moment of a contact can change its sign. A contact that would pull dissipates its stored energy, even
  !> without damping.
  pure logical function can_pull(coefficient)
    real(wp), intent(in) :: coefficient(:, :)   !! p_k, shape [order, lanes]

    can_pull = any(coefficient(1::2, :) < 0) .or. any(abs(coefficient(2::2, :)) > 0)
  end function can_pull

  subroutine describe(self, tape)
    class(gap_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: damped, elastic, half, moment, p(self%order), w, x
    integer :: k

    w = self%twist_from_rest(tape)
    p = coefficients_of(self, tape, self%order)
    half = 0.5_wp * self%parameter(tape, 'gap')
    x = w - by_branch(tape, [0, 1, 1, 1, -1, -1, -1]) * half
    elastic = polynomial(p, x)
    moment = by_branch(tape, [0, 1, 1, 1, 1, 1, 1]) * elastic
    damped = by_branch(tape, [0, 1, 0, 0, 1, 0, 0]) * self%parameter(tape, 'damping')
    tape%restoring = node_of(-moment)
    tape%applied = node_of(by_branch(tape, [0, 0, -1, 1, 0, -1, 1]) * elastic - damped * self%twist_speed(tape))
    if (self%has_friction) then
      tape%applied = node_of(by_branch(tape, [0, 0, -1, 1, 0, -1, 1]) * elastic - damped * self%twist_speed(tape) &
                             + self%friction(tape))
    end if
    tape%stored = node_of(by_branch(tape, [0, 1, 1, 1, 1, 1, 1]) * x &
                          * polynomial([((1.0_wp / (k + 1)) * p(k), k=1, self%order)], x))
    call self%describe_phase(tape)
    call guard_branches(self, tape, w, half, p)
  end subroutine describe

  !> One of some whole numbers, by the branch.
  function by_branch(tape, numbers) result(picked)
    type(law_tape_t), target, intent(inout) :: tape
    integer, intent(in) :: numbers(branches)
    type(expression_t) :: picked
    type(expression_t) :: choices(branches)
    integer :: i

    do i = 1, branches
      choices(i) = literal(tape, real(numbers(i), wp))
    end do
    picked = pick(1, choices)
  end function by_branch

  !> The depth of the penetration of an edge as a moment, by the stiffness sum |p_k| gap^(k - 1), the elastic and the viscous
  !> moment, positive where they push the bodies apart, decide on the branch.
  subroutine guard_branches(self, tape, w, half, p)
    class(gap_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t), intent(in) :: w, half, p(:)
    type(expression_t) :: depth, elastic, scale, shift, viscous
    integer :: beyond, k, side

    scale = size_of(p(self%order))
    do k = self%order - 1, 1, -1
      scale = size_of(p(k)) + 2.0_wp * half * scale
    end do
    shift = (boundary_width * 2.0_wp) * half * scale
    do side = 1, -1, -2
      beyond = merge(0, separating - free, side > 0)
      depth = real(side, wp) * w - half
      elastic = real(side, wp) * polynomial(p, real(side, wp) * depth)
      viscous = real(side, wp) * self%parameter(tape, 'damping') * self%twist_speed(tape)
      call add_guard(1, free, -(scale * depth), shift)
      call add_guard(1, contact + beyond, scale * depth, shift)
      call add_guard(1, contact + beyond, elastic - viscous, shift)
      call add_guard(1, contact + beyond, elastic + viscous, shift)
      call add_guard(1, closing + beyond, scale * depth, shift)
      call add_guard(1, closing + beyond, elastic, shift)
      call add_guard(1, closing + beyond, viscous - elastic, shift)
      call add_guard(1, separating + beyond, scale * depth, shift)
      call add_guard(1, separating + beyond, larger(-elastic, -(elastic + viscous)), shift)
    end do
  end subroutine guard_branches

end module nocdyn_gap_couplings
