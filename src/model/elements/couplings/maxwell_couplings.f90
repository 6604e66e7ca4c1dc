!> Couplings of rubber or fluid whose stiffness grows with the frequency: beside the spring and the damper stand Maxwell
!> branches, each a spring K in series with a damper: the generalised Maxwell model (N. W. Tschoegl, The Phenomenological Theory
!> of Linear Viscoelastic Behavior, 1989, pp. 119-126).
!>
!> The moments F of the branches are internal states: F' = K u' - F / time, where time is the damping of the branch over K. At a
!> frequency w the stiffness of a branch is K i w time / (1 + i w time).
module nocdyn_maxwell_couplings
  use nocdyn_couplings, only: coupling_common_t, couplings_t
  use nocdyn_element_keys, only: element_keys_t
  use nocdyn_elements, only: element_values_t
  use nocdyn_kinds, only: wp
  use nocdyn_law_expressions, only: expression_t, node_of, operator(*), operator(+), operator(-), operator(/), speed_of, state_of
  use nocdyn_law_tape, only: law_tape_t
  use nocdyn_polynomial_laws, only: coefficient_cubic, coefficient_linear, coefficient_rest
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: new_maxwell_couplings

  type, extends(couplings_t), public :: maxwell_couplings_t
  contains
    procedure :: describe
    procedure :: keep_energy
  end type maxwell_couplings_t

contains

  !> Couplings by eq. (3) with branches, without moments in these at the start.
  function new_maxwell_couplings(keys) result(bank)
    class(element_keys_t), intent(in) :: keys
    type(maxwell_couplings_t) :: bank
    integer :: e, k

    bank%states = keys%longest('maxwell_stiffness')
    allocate (bank%internal_names(bank%states))
    do k = 1, bank%states
      bank%internal_names(k) = 'moment of branch ' // to_text(k)
    end do
    call bank%set_common(coupling_common_t(keys))
    call bank%add_key(keys, 'stiffness')
    call bank%add_key(keys, 'cubic_stiffness')
    call bank%add_parts('branch stiffness', keys%lists('maxwell_stiffness', bank%states))
    call bank%add_parts('branch time', keys%lists('maxwell_time', bank%states, absent=1.0_wp))
    call bank%add_term('rest_twist', coefficient_rest, 1.0_wp)
    call bank%add_term('stiffness', coefficient_linear, 1.0_wp)
    call bank%add_term('cubic_stiffness', coefficient_cubic, 1.0_wp)
    call bank%add_damping()
    bank%has_polynomial_potential = .true.
    bank%with_work = [(e, e=1, bank%count)]
    call bank%prepare_law()
  end function new_maxwell_couplings

  subroutine describe(self, tape)
    class(maxwell_couplings_t), intent(in) :: self
    type(law_tape_t), target, intent(inout) :: tape
    type(expression_t) :: moment, force
    integer :: k

    do k = 1, self%states
      force = state_of(tape, k)
      if (k == 1) moment = -force
      if (k > 1) moment = moment - force
      tape%rate(k) = node_of(self%parameter(tape, 'branch stiffness', self%part_columns(k)) * speed_of(tape) &
                             - force / self%parameter(tape, 'branch time', self%part_columns(k)))
    end do
    if (self%has_friction) moment = moment + self%friction(tape)
    tape%applied = node_of(moment)
  end subroutine describe

  !> The springs of the branches keep F^2 / (2 K).
  pure subroutine keep_energy(self, elements)
    class(maxwell_couplings_t), intent(in) :: self
    type(element_values_t), intent(inout) :: elements   !! of the machine
    integer :: e, k, s, stiffness

    stiffness = self%number_of('branch stiffness')
    associate (value => self%parameters(stiffness)%value, internal => elements%internal%value)
      do e = 1, self%count
        elements%kept(:, self%first - 1 + e) = 0.0_wp
        do k = 1, self%states
          s = self%first_internal + self%states * (e - 1) + k - 1
          associate (column => e + (k - 1) * self%count)
            where (value(:, column) > 0) elements%kept(:, self%first - 1 + e) = elements%kept(:, self%first - 1 + e) &
                                                                              + internal(:, s)**2 / (2.0_wp * value(:, column))
          end associate
        end do
      end do
    end associate
  end subroutine keep_energy

end module nocdyn_maxwell_couplings
